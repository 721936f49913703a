//! Access to the registers of one of the two chips.

use embedded_hal_async::i2c::I2c;

use crate::Error;

/// The command that resets a chip, in its register for commands.
pub const SOFT_RESET: u8 = 0xb6;
/// The register of the identity, in both chips.
const CHIP_ID: u8 = 0x00;

/// Reads registers from `register` on.
pub async fn read<B: I2c, const N: usize>(
    bus: &mut B,
    address: u8,
    register: u8,
) -> Result<[u8; N], B::Error> {
    let mut values = [0; N];
    bus.write_read(address, &[register], &mut values).await?;
    Ok(values)
}

/// Writes a register.
pub async fn write<B: I2c>(
    bus: &mut B,
    address: u8,
    register: u8,
    value: u8,
) -> Result<(), B::Error> {
    bus.write(address, &[register, value]).await
}

/// Checks the identity of a chip.
pub async fn check_id<B: I2c>(bus: &mut B, address: u8, id: u8) -> Result<(), Error<B::Error>> {
    let [found] = read(bus, address, CHIP_ID).await?;
    if found == id { Ok(()) } else { Err(Error::WrongId { found }) }
}

/// Reads a register back, and compares the bits of `mask`.
pub async fn check<B: I2c>(
    bus: &mut B,
    address: u8,
    register: u8,
    value: u8,
    mask: u8,
) -> Result<(), Error<B::Error>> {
    let [found] = read(bus, address, register).await?;
    if found & mask == value {
        Ok(())
    } else {
        Err(Error::ConfigurationRefused { register, found })
    }
}

/// Returns the three axes of a sample, which is little-endian.
pub fn axes([x_low, x_high, y_low, y_high, z_low, z_high]: [u8; 6]) -> [i16; 3] {
    [
        i16::from_le_bytes([x_low, x_high]),
        i16::from_le_bytes([y_low, y_high]),
        i16::from_le_bytes([z_low, z_high]),
    ]
}
