//! The DMA controller (RM0091 10): transfers between a peripheral and memory, one data item per
//! request.
//!
//! The memory belongs to the core: a [`Transfer`] describes the data, and the owner of the memory
//! moves it.

use crate::Width;
use crate::stm32::{Transfer, Write};

const ISR: u32 = 0x00;
const IFCR: u32 = 0x04;
const FIRST_CHANNEL: u32 = 0x08;
const CHANNEL_SIZE: u32 = 20;
pub(super) const CHANNELS: usize = 5;

const CCR_EN: u32 = 1 << 0;
const CCR_TCIE: u32 = 1 << 1;
const CCR_HTIE: u32 = 1 << 2;
const CCR_DIR: u32 = 1 << 4;
const CCR_CIRC: u32 = 1 << 5;
const CCR_PINC: u32 = 1 << 6;
const CCR_MINC: u32 = 1 << 7;
const CCR_MEM2MEM: u32 = 1 << 14;
/// Flags of a channel: all, complete, half.
const GIF: u32 = 1;
const TCIF: u32 = 2;
const HTIF: u32 = 4;

#[derive(Clone, Copy, Default)]
struct Channel {
    ccr: u32,
    cndtr: u32,
    cpar: u32,
    cmar: u32,
    /// The length of the running transfer when it started, in data items.
    total: u32,
    done: u32,
}

#[derive(Default)]
pub(crate) struct Dma {
    isr: u32,
    channels: [Channel; CHANNELS],
    /// True if any channel is on.
    is_on: bool,
}

impl Dma {
    /// Returns true if any channel is on.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Returns true if channel `index` has data to move in this direction.
    pub fn is_ready(&self, index: usize, to_peripheral: bool) -> bool {
        self.channels.get(index).is_some_and(|channel| {
            channel.ccr & CCR_EN != 0
                && channel.cndtr > 0
                && (channel.ccr & CCR_DIR != 0) == to_peripheral
        })
    }

    /// Returns the data item that channel `index` (0 for channel 1) moves, now that its peripheral
    /// requests a transfer. Returns none if the channel is not ready in this direction.
    pub fn request(&mut self, index: usize, to_peripheral: bool) -> Option<Transfer> {
        if !self.is_ready(index, to_peripheral) {
            return None;
        }
        let channel = self.channels.get_mut(index)?;
        let width = |field: u32| match channel.ccr >> field & 3 {
            0 => Width::Byte,
            1 => Width::Half,
            _ => Width::Word,
        };
        let (peripheral_width, memory_width) = (width(8), width(10));
        let advanced = |base: u32, increments: u32, width: Width| {
            let step = if channel.ccr & increments != 0 { width.bytes() } else { 0 };
            base.wrapping_add(channel.done * step)
        };
        let peripheral = (advanced(channel.cpar, CCR_PINC, peripheral_width), peripheral_width);
        let memory = (advanced(channel.cmar, CCR_MINC, memory_width), memory_width);
        channel.done += 1;
        channel.cndtr -= 1;
        let mut flags = 0;
        if channel.done == channel.total.div_ceil(2) {
            flags |= HTIF;
        }
        if channel.cndtr == 0 {
            flags |= TCIF;
            if channel.ccr & CCR_CIRC != 0 {
                channel.cndtr = channel.total;
                channel.done = 0;
            }
        }
        if flags != 0 {
            self.isr |= (flags | GIF) << (4 * index);
        }
        let (from, to) = if to_peripheral { (memory, peripheral) } else { (peripheral, memory) };
        Some(Transfer { from, to })
    }

    /// Returns true if any channel may request its interrupt.
    pub fn is_watched(&self) -> bool {
        self.channels.iter().any(|channel| channel.ccr & (CCR_TCIE | CCR_HTIE) != 0)
    }

    /// Returns true if channel `index` requests its interrupt.
    pub fn interrupt(&self, index: usize) -> bool {
        let enabled = self.channels[index].ccr & (CCR_TCIE | CCR_HTIE);
        self.isr >> (4 * index) & enabled != 0
    }

    pub fn read(&self, offset: u32) -> u32 {
        if offset < FIRST_CHANNEL {
            return if offset == ISR { self.isr } else { 0 };
        }
        let at = offset - FIRST_CHANNEL;
        let Some(channel) = self.channels.get((at / CHANNEL_SIZE) as usize) else { return 0 };
        match at % CHANNEL_SIZE {
            0x0 => channel.ccr,
            0x4 => channel.cndtr,
            0x8 => channel.cpar,
            0xc => channel.cmar,
            _ => 0,
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write) -> bool {
        if offset == IFCR {
            // CGIF clears all flags of its channel (10.4.2).
            let all = (0..CHANNELS).filter(|index| write.ones() >> (4 * index) & GIF != 0);
            self.isr &= !all.fold(write.ones(), |bits, index| bits | 0xf << (4 * index));
            return true;
        }
        let Some(at) = offset.checked_sub(FIRST_CHANNEL) else { return true };
        let Some(channel) = self.channels.get_mut((at / CHANNEL_SIZE) as usize) else {
            return true;
        };
        let is_on = channel.ccr & CCR_EN != 0;
        match at % CHANNEL_SIZE {
            0x0 => {
                channel.ccr = write.merge(channel.ccr) & 0x7fff;
                if channel.ccr & CCR_EN != 0 && !is_on {
                    channel.total = channel.cndtr;
                    channel.done = 0;
                }
                let modeled = channel.ccr & CCR_MEM2MEM == 0;
                self.is_on = self.channels.iter().any(|channel| channel.ccr & CCR_EN != 0);
                return modeled;
            }
            // Locked while the channel is on (10.4.4 to 10.4.6).
            _ if is_on => {}
            0x4 => channel.cndtr = write.merge(channel.cndtr) & 0xffff,
            0x8 => channel.cpar = write.merge(channel.cpar),
            0xc => channel.cmar = write.merge(channel.cmar),
            _ => {}
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(dma: &mut Dma, offset: u32, value: u32) {
        assert!(dma.write(offset, Write::new(offset, Width::Word, value)));
    }

    #[test]
    fn moves_items_until_its_count_is_zero() {
        let mut dma = Dma::default();
        // Channel 3: two bytes from memory to SPI1_DR, interrupt when done.
        write(&mut dma, 0x30 + 0x4, 2);
        write(&mut dma, 0x30 + 0x8, 0x4001_300c);
        write(&mut dma, 0x30 + 0xc, 0x2000_0100);
        assert_eq!(dma.request(2, true), None, "it is not on");
        write(&mut dma, 0x30, CCR_EN | CCR_TCIE | CCR_DIR | CCR_MINC);
        assert_eq!(dma.request(2, false), None, "the other way");
        for at in 0..2 {
            let transfer =
                Transfer { from: (0x2000_0100 + at, Width::Byte), to: (0x4001_300c, Width::Byte) };
            assert_eq!(dma.request(2, true), Some(transfer));
        }
        assert_eq!(dma.request(2, true), None);
        assert!(dma.interrupt(2));
        assert_eq!(dma.read(ISR), 0x700);
        write(&mut dma, IFCR, 0x100);
        assert_eq!(dma.read(ISR), 0);
    }

    #[test]
    fn a_full_circle_starts_again() {
        let mut dma = Dma::default();
        write(&mut dma, 0x08 + 0x4, 1);
        write(&mut dma, 0x08 + 0xc, 0x2000_0000);
        write(&mut dma, 0x08, CCR_EN | CCR_CIRC | CCR_MINC | 1 << 8 | 1 << 10);
        for _ in 0..2 {
            let to = dma.request(0, false).unwrap().to;
            assert_eq!(to, (0x2000_0000, Width::Half));
        }
        assert_eq!(dma.read(0x08 + 0x4), 1);
    }
}
