//! Instructions at which the bridge must stop the core, found in the image.
//!
//! A match may be data or the second half of another instruction. This is harmless: QEMU compares
//! the program counter with its breakpoints and changes no byte of the memory, and the program
//! counter never reaches such an address.

/// An instruction that the bridge must execute instead of QEMU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site {
    /// The action of the instruction.
    pub action: SiteAction,
    /// Length of the instruction in bytes.
    pub length: u32,
}

/// The action of an instruction at a site.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SiteAction {
    /// WFE: QEMU has no event register.
    WaitForEvent,
    /// WFI: the board's time would stand still, because only the bridge advances it.
    WaitForInterrupt,
    /// SEV: QEMU ignores it.
    SendEvent,
    /// A branch to itself, as at the end of a handler for unexpected exceptions: the core also
    /// waits, until an interrupt comes.
    Stay,
    /// MSR MSP, Rn: needed only if the stack was moved to another address.
    SetStackPointer {
        /// Number of the register.
        register: u8,
    },
}

impl Site {
    /// Returns the site for the instruction with the half-words `first` and `second`.
    fn of(first: u16, second: u16) -> Option<Site> {
        // ARMv7-M manual, A7.7.262, A7.7.263, A7.7.129, each in two encodings, A7.7.12 (T2) and B5.2.3.
        let (action, length) = match (first, second) {
            (0xbf20, _) => (SiteAction::WaitForEvent, 2),
            (0xf3af, 0x8002) => (SiteAction::WaitForEvent, 4),
            (0xbf30, _) => (SiteAction::WaitForInterrupt, 2),
            (0xf3af, 0x8003) => (SiteAction::WaitForInterrupt, 4),
            (0xbf40, _) => (SiteAction::SendEvent, 2),
            (0xf3af, 0x8004) => (SiteAction::SendEvent, 4),
            (0xe7fe, _) => (SiteAction::Stay, 2),
            (0xf380..=0xf38f, 0x8808) => {
                (SiteAction::SetStackPointer { register: (first & 0xf) as u8 }, 4)
            }
            _ => return None,
        };
        Some(Site { action, length })
    }
}

/// Returns all sites in `code`, which is at `address`.
pub fn find(address: u32, code: &[u8]) -> impl Iterator<Item = (u32, Site)> {
    halves(code).filter_map(move |(offset, first, second)| {
        Site::of(first, second).map(|site| (address + offset, site))
    })
}

/// Returns the address of a `BX LR` in `code`, which is at `address`.
pub fn find_return(address: u32, code: &[u8]) -> Option<u32> {
    halves(code).find(|(_, first, _)| *first == 0x4770).map(|(offset, ..)| address + offset)
}

/// Returns each half-word with its offset and the half-word after it.
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
    fn finds_the_assemblers_encodings() {
        // wfe; wfi; sev; nop; b .; msr msp, r0; msr primask, r0; msr msp, r9; wfe.w; wfi.w; sev.w; bx lr
        // (GNU assembler 2.40)
        let halves = [
            0xbf20, 0xbf30, 0xbf40, 0xbf00, 0xe7fe, 0xf380, 0x8808, 0xf380, 0x8810, 0xf389, 0x8808,
            0xf3af, 0x8002, 0xf3af, 0x8003, 0xf3af, 0x8004, 0x4770,
        ];
        let code: Vec<u8> = halves.iter().flat_map(|half: &u16| half.to_le_bytes()).collect();
        let sites: Vec<_> = find(0x0800_4000, &code)
            .map(|(address, site)| (address, site.action, site.length))
            .collect();
        let expected = [
            (0x0800_4000, SiteAction::WaitForEvent, 2),
            (0x0800_4002, SiteAction::WaitForInterrupt, 2),
            (0x0800_4004, SiteAction::SendEvent, 2),
            (0x0800_4008, SiteAction::Stay, 2),
            (0x0800_400a, SiteAction::SetStackPointer { register: 0 }, 4),
            (0x0800_4012, SiteAction::SetStackPointer { register: 9 }, 4),
            (0x0800_4016, SiteAction::WaitForEvent, 4),
            (0x0800_401a, SiteAction::WaitForInterrupt, 4),
            (0x0800_401e, SiteAction::SendEvent, 4),
        ];
        assert_eq!(sites, expected);
        assert_eq!(find_return(0x0800_4000, &code), Some(0x0800_4022));
        assert_eq!(find_return(0x0800_4000, &code[..34]), None);
    }
}
