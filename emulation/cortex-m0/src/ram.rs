//! Accesses to the RAM. A function returns none outside the RAM, or if the address is not aligned.

use crate::bus::RAM;

/// Returns the index of an address in the RAM. Addresses outside give an index beyond its end.
#[inline]
fn index(address: u32) -> usize {
    address.wrapping_sub(RAM) as usize
}

/// Returns the number of the unit of 2^`SHIFT` bytes at an address. The rotation makes the number
/// of an address that is not aligned larger than any RAM.
#[inline]
fn number<const SHIFT: u32>(address: u32) -> usize {
    address.wrapping_sub(RAM).rotate_right(SHIFT) as usize
}

#[inline]
pub fn word(ram: &[u8], address: u32) -> Option<u32> {
    ram.as_chunks().0.get(number::<2>(address)).copied().map(u32::from_le_bytes)
}

#[inline]
pub fn half(ram: &[u8], address: u32) -> Option<u16> {
    ram.as_chunks().0.get(number::<1>(address)).copied().map(u16::from_le_bytes)
}

#[inline]
pub fn byte(ram: &[u8], address: u32) -> Option<u8> {
    ram.get(index(address)).copied()
}

#[inline]
pub fn set_word(ram: &mut [u8], address: u32, value: u32) -> Option<()> {
    *ram.as_chunks_mut().0.get_mut(number::<2>(address))? = value.to_le_bytes();
    Some(())
}

#[inline]
pub fn set_half(ram: &mut [u8], address: u32, value: u16) -> Option<()> {
    *ram.as_chunks_mut().0.get_mut(number::<1>(address))? = value.to_le_bytes();
    Some(())
}

#[inline]
pub fn set_byte(ram: &mut [u8], address: u32, value: u8) -> Option<()> {
    *ram.get_mut(index(address))? = value;
    Some(())
}

/// Returns `count` words from `address` on.
#[inline]
pub fn words(ram: &[u8], address: u32, count: usize) -> Option<&[[u8; 4]]> {
    let bytes = ram.get(index(address)..index(address) + 4 * count)?;
    (address & 3 == 0).then_some(bytes.as_chunks().0)
}

/// Returns the same words for writing.
#[inline]
pub fn words_mut(ram: &mut [u8], address: u32, count: usize) -> Option<&mut [[u8; 4]]> {
    let bytes = ram.get_mut(index(address)..index(address) + 4 * count)?;
    (address & 3 == 0).then_some(bytes.as_chunks_mut().0)
}
