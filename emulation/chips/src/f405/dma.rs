//! A DMA controller of the STM32F4 (RM0090 10): transfers between a peripheral and memory, one data
//! item per request.
//!
//! The manual says that the registers of a stream are locked while it is on. Bitcraze's firmware
//! leaves a stream on when a chip on I2C does not acknowledge, writes its registers for the next
//! transfer, and works on chips. Here the lock begins with the first data item, and each write to the
//! registers of a stream that is on is reported as a mistake.
//!
//! The FIFO has no model: data items leave it at once, and the widths on both sides must be equal
//! when it is used. Bursts, double buffers, transfers between memories and the peripheral as flow
//! controller have no model either.

use crate::Width;
use crate::stm32::{Transfer, Write};

const LIFCR: u32 = 0x08;
const HIFCR: u32 = 0x0c;
const FIRST_STREAM: u32 = 0x10;
const STREAM_SIZE: u32 = 0x18;
pub(super) const STREAMS: usize = 8;

const CR_EN: u32 = 1 << 0;
/// The interrupt enable bits of the direct mode error, of a transfer error, of half and of complete
/// transfers have this distance to their flags.
const CR_INTERRUPTS: u32 = 0x1e;
const FLAGS_SHIFT: u32 = 1;
const CR_PFCTRL: u32 = 1 << 5;
const CR_DIR: u32 = 3 << 6;
const CR_DIR_TO_PERIPHERAL: u32 = 1 << 6;
const CR_DIR_IN_MEMORY: u32 = 2 << 6;
const CR_CIRC: u32 = 1 << 8;
const CR_PINC: u32 = 1 << 9;
const CR_MINC: u32 = 1 << 10;
const CR_PINCOS: u32 = 1 << 15;
const CR_DBM: u32 = 1 << 18;
const CR_BURSTS: u32 = 0xf << 21;
/// Bits that stay writable while the stream is on (10.5.5).
const CR_ALWAYS_WRITABLE: u32 = CR_EN | CR_INTERRUPTS;
const CR_BITS: u32 = 0x0fef_ffff;
const FCR_DMDIS: u32 = 1 << 2;
const FCR_FEIE: u32 = 1 << 7;
/// The FIFO is empty.
const FCR_RESET: u32 = 0x21;
/// Flags of a stream: FIFO error, transfer error, half, complete.
const FEIF: u32 = 1 << 0;
const TEIF: u32 = 1 << 3;
const HTIF: u32 = 1 << 4;
const TCIF: u32 = 1 << 5;
const FLAGS: u32 = 0x3d;
/// The position of a stream's flags in its register of four streams (10.5.1).
const FLAG_BITS: [u32; 4] = [0, 6, 16, 22];

#[derive(Clone, Copy)]
struct Stream {
    cr: u32,
    /// NDTR, and the value that the firmware wrote last.
    left: u32,
    programmed: u32,
    par: u32,
    m0ar: u32,
    m1ar: u32,
    fcr: u32,
    flags: u32,
    /// Data items moved since the start or the last wrap.
    done: u32,
}

impl Stream {
    const OFF: Stream = Stream {
        cr: 0,
        left: 0,
        programmed: 0,
        par: 0,
        m0ar: 0,
        m1ar: 0,
        fcr: FCR_RESET,
        flags: 0,
        done: 0,
    };

    fn width(&self, field: u32) -> Width {
        match self.cr >> field & 3 {
            0 => Width::Byte,
            1 => Width::Half,
            _ => Width::Word,
        }
    }

    fn is_modeled(&self) -> bool {
        let unmodeled = CR_PFCTRL | CR_PINCOS | CR_DBM | CR_BURSTS;
        let packs = self.fcr & FCR_DMDIS != 0 && self.width(11) != self.width(13);
        self.cr & unmodeled == 0 && self.cr & CR_DIR < CR_DIR_IN_MEMORY && !packs
    }
}

/// The result of a write to a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DmaWrite {
    /// The model has all that the write enables.
    Modeled,
    /// The write enables a function without a model.
    Unmodeled,
    /// The write changes a register of a stream that is on, which the manual does not allow.
    Locked,
}

/// The result of a request to a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moved {
    pub transfer: Transfer,
    /// Exactly one data item follows.
    pub one_left: bool,
}

pub(super) struct Dma {
    streams: [Stream; STREAMS],
    /// The streams that are on, as a mask.
    on: u8,
}

impl Dma {
    pub fn new() -> Self {
        Dma { streams: [Stream::OFF; STREAMS], on: 0 }
    }

    /// Returns true if any stream is on.
    pub fn is_on(&self) -> bool {
        self.on != 0
    }

    /// Returns the first stream that is on and whose request, by its number and its channel, is
    /// `due`. The software sets the priority, and the lower number wins a tie (10.3.5).
    pub fn first_due(&self, due: impl Fn(usize, u32) -> bool) -> Option<usize> {
        (0..STREAMS)
            .filter(|index| self.on >> index & 1 != 0)
            .filter(|index| {
                let stream = &self.streams[*index];
                stream.left > 0 && due(*index, stream.cr >> 25 & 7)
            })
            .min_by_key(|index| (3 - (self.streams[*index].cr >> 16 & 3), *index))
    }

    /// Returns the data item that stream `index` moves now. `is_reachable` returns true if
    /// the controller has a connection to the memory at this address, of this length; otherwise the
    /// stream ends with an error, and the result is the address (10.3.18).
    pub fn request(
        &mut self,
        index: usize,
        is_reachable: impl Fn(u32, u32) -> bool,
    ) -> Result<Moved, u32> {
        let stream = &mut self.streams[index];
        let peripheral_width = stream.width(11);
        // In direct mode the memory has the width of the peripheral (10.3.13).
        let memory_width =
            if stream.fcr & FCR_DMDIS == 0 { peripheral_width } else { stream.width(13) };
        let advanced = |base: u32, increments: u32, width: Width| {
            let step = if stream.cr & increments != 0 { width.bytes() } else { 0 };
            base.wrapping_add(stream.done * step)
        };
        let peripheral = (advanced(stream.par, CR_PINC, peripheral_width), peripheral_width);
        let memory = (advanced(stream.m0ar, CR_MINC, memory_width), memory_width);
        if !is_reachable(memory.0, memory_width.bytes()) {
            stream.flags |= TEIF;
            stream.cr &= !CR_EN;
            self.on &= !(1 << index);
            return Err(memory.0);
        }
        stream.done += 1;
        stream.left -= 1;
        let one_left = stream.left == 1;
        if stream.done == (stream.done + stream.left) / 2 {
            stream.flags |= HTIF;
        }
        if stream.left == 0 {
            stream.flags |= TCIF;
            if stream.cr & CR_CIRC != 0 {
                stream.left = stream.programmed;
                stream.done = 0;
            } else {
                stream.cr &= !CR_EN;
                self.on &= !(1 << index);
            }
        }
        let to_peripheral = stream.cr & CR_DIR == CR_DIR_TO_PERIPHERAL;
        let (from, to) = if to_peripheral { (memory, peripheral) } else { (peripheral, memory) };
        Ok(Moved { transfer: Transfer { from, to }, one_left })
    }

    /// Returns true if stream `index` requests its interrupt.
    pub fn interrupt(&self, index: usize) -> bool {
        let stream = &self.streams[index];
        let fifo = stream.flags & FEIF != 0 && stream.fcr & FCR_FEIE != 0;
        stream.flags & (stream.cr & CR_INTERRUPTS) << FLAGS_SHIFT != 0 || fifo
    }

    pub fn read(&self, offset: u32) -> u32 {
        if offset < FIRST_STREAM {
            // LISR and HISR; the registers that clear flags read as 0.
            let first = offset as usize;
            return match self.streams.get(first..first + 4) {
                Some(streams) => streams
                    .iter()
                    .zip(FLAG_BITS)
                    .fold(0, |flags, (stream, bit)| flags | stream.flags << bit),
                None => 0,
            };
        }
        let at = offset - FIRST_STREAM;
        let Some(stream) = self.streams.get((at / STREAM_SIZE) as usize) else { return 0 };
        match at % STREAM_SIZE {
            0x00 => stream.cr,
            0x04 => stream.left,
            0x08 => stream.par,
            0x0c => stream.m0ar,
            0x10 => stream.m1ar,
            _ => stream.fcr,
        }
    }

    /// Writes a register.
    pub fn write(&mut self, offset: u32, write: Write) -> DmaWrite {
        if offset < FIRST_STREAM {
            if (LIFCR..=HIFCR).contains(&offset) {
                let first = (offset - LIFCR) as usize;
                for (stream, bit) in self.streams[first..first + 4].iter_mut().zip(FLAG_BITS) {
                    stream.flags &= !(write.ones() >> bit & FLAGS);
                }
            }
            return DmaWrite::Modeled;
        }
        let at = offset - FIRST_STREAM;
        let index = (at / STREAM_SIZE) as usize;
        let register = at % STREAM_SIZE;
        if register == 0 {
            return self.write_control(index, write);
        }
        let Some(stream) = self.streams.get_mut(index) else { return DmaWrite::Modeled };
        let value = match register {
            0x04 => &mut stream.left,
            0x08 => &mut stream.par,
            0x0c => &mut stream.m0ar,
            0x10 => &mut stream.m1ar,
            _ => &mut stream.fcr,
        };
        let new = match register {
            0x04 => write.merge(*value) & 0xffff,
            0x14 => write.merge(*value) & 0x87 | FCR_RESET & 0x38,
            _ => write.merge(*value),
        };
        let is_locked = stream.cr & CR_EN != 0 && new != *value;
        if !is_locked || stream.done == 0 {
            *value = new;
            if register == 0x04 {
                stream.programmed = new;
            }
        }
        if is_locked { DmaWrite::Locked } else { DmaWrite::Modeled }
    }

    fn write_control(&mut self, index: usize, write: Write) -> DmaWrite {
        let Some(stream) = self.streams.get_mut(index) else { return DmaWrite::Modeled };
        let was_on = stream.cr & CR_EN != 0;
        let new = write.merge(stream.cr) & CR_BITS;
        let is_locked = was_on && (new ^ stream.cr) & !CR_ALWAYS_WRITABLE != 0;
        stream.cr = if is_locked && stream.done > 0 {
            stream.cr & !CR_ALWAYS_WRITABLE | new & CR_ALWAYS_WRITABLE
        } else {
            new
        };
        if new & CR_EN == 0 {
            self.on &= !(1 << index);
            if was_on {
                // The end of a transfer that software stops raises the flag, too (10.3.14).
                stream.flags |= TCIF;
            }
        } else if !was_on {
            // NDTR is loaded again if the last transfer was complete (10.5.6).
            if stream.left == 0 {
                stream.left = stream.programmed;
            }
            stream.done = 0;
            self.on |= 1 << index;
            if !stream.is_modeled() {
                return DmaWrite::Unmodeled;
            }
        }
        if is_locked { DmaWrite::Locked } else { DmaWrite::Modeled }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: fn(u32, u32) -> bool = |_, _| true;

    fn write(dma: &mut Dma, offset: u32, value: u32) {
        let written = dma.write(offset, Write::new(offset, Width::Word, value));
        assert_eq!(written, DmaWrite::Modeled);
    }

    /// The offset of a register of stream `index` (10.5.5: 0x10 + 0x18 * stream).
    fn register(index: u32, register: u32) -> u32 {
        0x10 + 0x18 * index + register
    }

    /// Sets up stream `index` for `count` items between 0x2000_0100 and 0x4001_1404.
    fn set_up(dma: &mut Dma, index: u32, count: u32) {
        write(dma, register(index, 0x04), count);
        write(dma, register(index, 0x08), 0x4001_1404);
        write(dma, register(index, 0x0c), 0x2000_0100);
    }

    const CHANNEL_5: u32 = 5 << 25;
    const TCIE: u32 = 1 << 4;
    const TEIE: u32 = 1 << 2;

    #[test]
    fn moves_items_until_its_count_is_zero() {
        let mut dma = Dma::new();
        set_up(&mut dma, 7, 3);
        assert!(!dma.is_on());
        write(&mut dma, register(7, 0), CHANNEL_5 | CR_MINC | CR_DIR_TO_PERIPHERAL | TCIE | CR_EN);
        assert_eq!(dma.first_due(|_, channel| channel == 4), None, "another channel");
        for (at, one_left) in [(0, false), (1, true), (2, false)] {
            assert_eq!(dma.first_due(|index, channel| (index, channel) == (7, 5)), Some(7));
            assert!(!dma.interrupt(7));
            let transfer =
                Transfer { from: (0x2000_0100 + at, Width::Byte), to: (0x4001_1404, Width::Byte) };
            assert_eq!(dma.request(7, ANY), Ok(Moved { transfer, one_left }));
        }
        assert_eq!(dma.first_due(|_, _| true), None);
        assert!(dma.interrupt(7));
        // HISR: TCIF7 is bit 27, HTIF7 bit 26 (10.5.2).
        assert_eq!((dma.read(0x00), dma.read(0x04)), (0, 1 << 27 | 1 << 26));
        assert_eq!(dma.read(register(7, 0)) & CR_EN, 0, "the hardware clears EN");
        assert_eq!(dma.read(register(7, 4)), 0);
        write(&mut dma, 0x0c, 1 << 27);
        assert_eq!(dma.read(0x04), 1 << 26);
        assert!(!dma.interrupt(7));
        // Enabled again, the count is loaded again.
        write(&mut dma, register(7, 0), CHANNEL_5 | CR_DIR_TO_PERIPHERAL | CR_EN);
        assert_eq!(dma.read(register(7, 4)), 3);
    }

    #[test]
    fn flags_have_the_manuals_positions() {
        // TCIF of streams 0 to 3 are bits 5, 11, 21 and 27 of LISR, those of 4 to 7 of HISR
        // (10.5.1, 10.5.2).
        for (index, bit) in (0..8).zip([5, 11, 21, 27].into_iter().cycle()) {
            let mut dma = Dma::new();
            set_up(&mut dma, index, 2);
            write(&mut dma, register(index, 0), CR_EN);
            write(&mut dma, register(index, 0), 0);
            let flags = if index < 4 { [1 << bit, 0] } else { [0, 1 << bit] };
            assert_eq!([dma.read(0x00), dma.read(0x04)], flags, "stopped by software");
            write(&mut dma, if index < 4 { 0x08 } else { 0x0c }, 1 << bit);
            assert_eq!([dma.read(0x00), dma.read(0x04)], [0, 0]);
        }
    }

    #[test]
    fn a_full_circle_starts_again() {
        let mut dma = Dma::new();
        set_up(&mut dma, 1, 2);
        write(&mut dma, register(1, 0), CR_CIRC | CR_MINC | 1 << 11 | CR_EN);
        for at in [0, 2, 0, 2] {
            let to = dma.request(1, ANY).unwrap().transfer.to;
            assert_eq!(to, (0x2000_0100 + at, Width::Half), "direct mode ignores MSIZE");
        }
        assert_eq!(dma.read(register(1, 4)), 2);
    }

    #[test]
    fn memory_out_of_reach_ends_the_stream_with_an_error() {
        let mut dma = Dma::new();
        set_up(&mut dma, 2, 6);
        write(&mut dma, register(2, 0x0c), 0x1000_0040);
        write(&mut dma, register(2, 0), CR_MINC | TEIE | CR_EN);
        assert_eq!(dma.request(2, |address, _| address >= 0x2000_0000), Err(0x1000_0040));
        // TEIF2 is bit 19 of LISR.
        assert_eq!(dma.read(0x00), 1 << 19);
        assert!(dma.interrupt(2) && !dma.is_on());
    }

    #[test]
    fn the_higher_priority_comes_first() {
        let mut dma = Dma::new();
        for (index, priority) in [(0, 0), (3, 2), (5, 2)] {
            set_up(&mut dma, index, 2);
            write(&mut dma, register(index, 0), priority << 16 | CR_EN);
        }
        assert_eq!(dma.first_due(|_, _| true), Some(3));
    }

    #[test]
    fn registers_are_locked_while_the_stream_is_on() {
        let mut dma = Dma::new();
        assert_eq!(dma.read(register(0, 0x14)), 0x21, "reset value of SxFCR (10.5.10)");
        set_up(&mut dma, 0, 2);
        write(&mut dma, register(0, 0), CR_EN);
        // The same values are no change.
        set_up(&mut dma, 0, 2);
        write(&mut dma, register(0, 0), TCIE | CR_EN);
        let count = |value| Write::new(0, Width::Word, value);
        // Nothing was moved yet.
        assert_eq!(dma.write(register(0, 4), count(3)), DmaWrite::Locked);
        assert_eq!(dma.read(register(0, 4)), 3);
        dma.request(0, ANY).unwrap();
        assert_eq!(dma.write(register(0, 4), count(9)), DmaWrite::Locked);
        let control = count(CR_MINC | TCIE | CR_EN);
        assert_eq!(dma.write(register(0, 0), control), DmaWrite::Locked);
        assert_eq!((dma.read(register(0, 4)), dma.read(register(0, 0))), (2, TCIE | CR_EN));
    }

    #[test]
    fn transfers_in_memory_have_no_model() {
        let write = Write::new(0, Width::Word, CR_DIR_IN_MEMORY | CR_EN);
        assert_eq!(Dma::new().write(register(0, 0), write), DmaWrite::Unmodeled);
    }
}
