//! The records that `simavr` makes (simavr's `avr_mcu_section.h`): entries with a tag, a length and
//! that number of bytes.

/// A register to record.
#[repr(C, packed)]
struct Register {
    tag: u8,
    length: u8,
    mask: u8,
    address: u16,
    name: [u8; 32],
}

/// An entry with a number.
#[repr(C, packed)]
struct Long {
    tag: u8,
    length: u8,
    value: u32,
}

const TAG_VCD_PERIOD: u8 = 13;
const TAG_VCD_TRACE: u8 = 14;
const ALL_BITS: u8 = 0xff;

const fn register<const N: usize>(address: u16, text: &[u8; N]) -> Register {
    let mut name = [0; 32];
    let mut at = 0;
    while at < N {
        name[at] = text[at];
        at += 1;
    }
    let length = size_of::<Register>() as u8 - 2;
    Register { tag: TAG_VCD_TRACE, length, mask: ALL_BITS, address, name }
}

/// All entries. The section is not loaded into the chip.
#[repr(C, packed)]
struct SimavrSection {
    registers: [Register; 3],
    /// The interval at which the record is written to its file, in µs.
    period: Long,
    end: [u8; 2],
}

#[allow(non_upper_case_globals, reason = "simavr's name for it")]
/// simavr finds the section by its name; arguments of the linker keep it and place it beyond all
/// memory.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".mmcu")]
static _mmcu: SimavrSection = SimavrSection {
    // The registers have addresses in data space.
    registers: [register(0x3e, b"GPIOR0"), register(0x4a, b"GPIOR1"), register(0x4b, b"GPIOR2")],
    period: Long { tag: TAG_VCD_PERIOD, length: 4, value: 1000 },
    end: [0; 2],
};
