//! The records that `simavr` shall make (simavr's `avr_mcu_section.h`): entries of a tag, a length
//! and so many bytes.

/// A register to record.
#[repr(C, packed)]
struct Register {
    tag: u8,
    length: u8,
    mask: u8,
    address: u16,
    name: [u8; 32],
}

/// A number.
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

/// All of them. Not loaded into the chip.
#[repr(C, packed)]
struct SimavrSection {
    registers: [Register; 3],
    /// How often the record is written to its file, in µs.
    period: Long,
    end: [u8; 2],
}

#[allow(non_upper_case_globals, reason = "simavr's name for it")]
/// Found by simavr by the name of the section; kept and placed beyond all memory by the linker's arguments.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".mmcu")]
static _mmcu: SimavrSection = SimavrSection {
    // Data addresses.
    registers: [register(0x3e, b"GPIOR0"), register(0x4a, b"GPIOR1"), register(0x4b, b"GPIOR2")],
    period: Long { tag: TAG_VCD_PERIOD, length: 4, value: 1000 },
    end: [0; 2],
};
