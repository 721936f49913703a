//! Instructions at which the bridge must stop the core, found in the image.
//!
//! What looks like such an instruction may be data or the second half of another instruction. That does no
//! harm: QEMU compares the program counter with its breakpoints and changes no byte of the memory, and the
//! program counter never gets there.

/// An instruction that QEMU does not do as the bridge needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// WFE: QEMU has no event register.
    WaitForEvent,
    /// WFI: time is the board's, it would stand still.
    WaitForInterrupt,
    /// SEV: QEMU ignores it.
    SendEvent,
    /// A branch to itself, the end of a handler for the unexpected: waits too, until an interrupt comes.
    Stay,
    /// MSR MSP, Rn: only of interest if the stack had to be moved.
    SetStackPointer {
        /// Number of the register.
        register: u8,
    },
}

impl Site {
    /// The instruction with the half-words `first` and `second`.
    fn of(first: u16, second: u16) -> Option<Site> {
        // ARMv7-M manual, A7.7.262, A7.7.263, A7.7.129, A7.7.12 (encoding T2) and B5.2.3.
        match (first, second) {
            (0xbf20, _) => Some(Site::WaitForEvent),
            (0xbf30, _) => Some(Site::WaitForInterrupt),
            (0xbf40, _) => Some(Site::SendEvent),
            (0xe7fe, _) => Some(Site::Stay),
            (0xf380..=0xf38f, 0x8808) => {
                Some(Site::SetStackPointer { register: (first & 0xf) as u8 })
            }
            _ => None,
        }
    }
}

/// All sites in `code`, which stands at `address`.
pub fn find(address: u32, code: &[u8]) -> impl Iterator<Item = (u32, Site)> {
    halves(code).filter_map(move |(offset, first, second)| {
        Site::of(first, second).map(|site| (address + offset, site))
    })
}

/// A `BX LR` in `code`, which stands at `address`.
pub fn find_return(address: u32, code: &[u8]) -> Option<u32> {
    halves(code).find(|(_, first, _)| *first == 0x4770).map(|(offset, ..)| address + offset)
}

/// Each half-word with its offset and the one behind it.
fn halves(code: &[u8]) -> impl Iterator<Item = (u32, u16, u16)> {
    let half = |pair: &[u8]| u16::from_le_bytes([pair[0], pair[1]]);
    code.chunks_exact(2).enumerate().map(move |(index, pair)| {
        let second = code.get(2 * index + 2..2 * index + 4).map_or(0, half);
        (2 * index as u32, half(pair), second)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_the_assembler_writes() {
        // wfe; wfi; sev; nop; b .; msr msp, r0; msr primask, r0; msr msp, r9; bx lr (GNU assembler 2.40)
        let code = [
            0x20, 0xbf, 0x30, 0xbf, 0x40, 0xbf, 0x00, 0xbf, 0xfe, 0xe7, 0x80, 0xf3, 0x08, 0x88,
            0x80, 0xf3, 0x10, 0x88, 0x89, 0xf3, 0x08, 0x88, 0x70, 0x47,
        ];
        let sites: Vec<_> = find(0x0800_4000, &code).collect();
        let expected = [
            (0x0800_4000, Site::WaitForEvent),
            (0x0800_4002, Site::WaitForInterrupt),
            (0x0800_4004, Site::SendEvent),
            (0x0800_4008, Site::Stay),
            (0x0800_400a, Site::SetStackPointer { register: 0 }),
            (0x0800_4012, Site::SetStackPointer { register: 9 }),
        ];
        assert_eq!(sites, expected);
        assert_eq!(find_return(0x0800_4000, &code), Some(0x0800_4016));
        assert_eq!(find_return(0x0800_4000, &code[..22]), None);
    }
}
