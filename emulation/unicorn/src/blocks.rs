//! The number of instructions in a block of code, and the ones among them that the core must
//! handle.
//!
//! Unicorn reports a block by address and size. Thumb instructions have two or four bytes, so a
//! block must be parsed to count them. The results for blocks in flash are stored.

/// The properties of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CodeBlock {
    /// Number of instructions.
    pub instructions: u16,
    /// True if the block may change PRIMASK, BASEPRI or FAULTMASK.
    pub masks: bool,
    /// True if the block executes SEV, which Unicorn does not emulate.
    pub sends_event: bool,
    /// True if the block ends with WFE.
    pub waits_for_event: bool,
    /// True if the block has an instruction that ARMv6-M lacks.
    pub beyond_armv6m: bool,
}

impl CodeBlock {
    /// Parses the instructions in `code`.
    pub fn parse(code: &[u8]) -> Self {
        let mut block = CodeBlock::default();
        let mut halfwords = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        while let Some(first) = halfwords.next() {
            block.instructions += 1;
            // 0b11101, 0b11110 and 0b11111 begin an instruction of 32 bits (ARMv7-M A5.1).
            let second = if first >> 11 >= 0b11101 { halfwords.next() } else { None };
            block.waits_for_event = false;
            block.beyond_armv6m |= !is_armv6m(first, second);
            match (first, second) {
                (0xbf20, _) | (0xf3af, Some(0x8002)) => block.waits_for_event = true,
                (0xbf40, _) | (0xf3af, Some(0x8004)) => block.sends_event = true,
                // CPS
                (0xb660..=0xb67f, _) => block.masks = true,
                // MSR of PRIMASK, BASEPRI, BASEPRI_MAX, FAULTMASK
                (0xf380..=0xf38f, Some(special)) => {
                    block.masks |= matches!(special & 0xff, 0x10..=0x13);
                }
                _ => {}
            }
        }
        block
    }
}

/// Returns true if an instruction is part of ARMv6-M (DDI 0419 A5.2, A5.3).
fn is_armv6m(first: u16, second: Option<u16>) -> bool {
    match (first, second) {
        // CBZ, CBNZ; IT. The hints next to IT have 0 in their lowest four bits.
        (0xb100..=0xb1ff | 0xb300..=0xb3ff | 0xb900..=0xb9ff | 0xbb00..=0xbbff, None) => false,
        (0xbf00..=0xbfff, None) => first & 0xf == 0,
        (_, None) => true,
        // BL; MSR, MRS, DSB, DMB, ISB, UDF.
        (0xf000..=0xf7ff, Some(second)) if second & 0xd000 == 0xd000 => true,
        (0xf380..=0xf38f, Some(second)) => second & 0xff00 == 0x8800,
        (0xf3ef, Some(second)) => second & 0xf000 == 0x8000,
        (0xf3bf, Some(second)) => matches!(second & 0xfff0, 0x8f40 | 0x8f50 | 0x8f60),
        (0xf7f0..=0xf7ff, Some(second)) => second & 0xf000 == 0xa000,
        _ => false,
    }
}

/// The number of blocks that are stored; a power of two.
const KNOWN: usize = 8192;

/// A cache of parsed blocks. Every block that runs is looked up, so the cache is direct-mapped by
/// address.
pub struct Blocks {
    known: Vec<Known>,
}

#[derive(Clone, Copy, Default)]
struct Known {
    address: u32,
    /// 0 for an unused entry; no block is empty.
    size: u32,
    block: CodeBlock,
}

impl Blocks {
    pub fn new() -> Self {
        Blocks { known: vec![Known::default(); KNOWN] }
    }

    fn place(address: u32) -> usize {
        address as usize / 2 % KNOWN
    }

    pub fn get(&self, address: u32, size: u32) -> Option<CodeBlock> {
        let known = self.known[Self::place(address)];
        (known.address == address && known.size == size).then_some(known.block)
    }

    pub fn insert(&mut self, address: u32, size: u32, block: CodeBlock) {
        self.known[Self::place(address)] = Known { address, size, block };
    }

    /// Discards all blocks, after a change of memory.
    pub fn clear(&mut self) {
        self.known.fill(Known::default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(halfwords: &[u16]) -> CodeBlock {
        let bytes: Vec<u8> = halfwords.iter().flat_map(|half| half.to_le_bytes()).collect();
        CodeBlock::parse(&bytes)
    }

    #[test]
    fn counts_short_and_long_instructions() {
        // movs r0, #1; ldr.w r0, [r1, #4]; vadd.f32 s0, s0, s1; b .
        let block = parse(&[0x2001, 0xf8d1, 0x0004, 0xee30, 0x0a20, 0xe7fe]);
        assert_eq!(
            block,
            CodeBlock { instructions: 4, beyond_armv6m: true, ..CodeBlock::default() }
        );
    }

    #[test]
    fn recognizes_instructions_beyond_armv6m() {
        // cpsid i; wfe; bl; dmb; mrs; msr; rev; bx lr
        let code: &[&[u16]] = &[
            &[0xb672],
            &[0xbf20],
            &[0xf000, 0xf801],
            &[0xf3bf, 0x8f5f],
            &[0xf3ef, 0x8010],
            &[0xf380, 0x8810],
            &[0xba00],
            &[0x4770],
        ];
        for code in code {
            assert!(!parse(code).beyond_armv6m, "{code:x?}");
        }
        // cbz; it eq; ldr.w; movw; udiv; wfe.w; b.w; strexh
        let code: &[&[u16]] = &[
            &[0xb108],
            &[0xbf08],
            &[0xf8d1, 0x0004],
            &[0xf240, 0x0001],
            &[0xfbb0, 0xf0f1],
            &[0xf3af, 0x8002],
            &[0xf000, 0xb801],
            &[0xe8c1, 0x0f50],
        ];
        for code in code {
            assert!(parse(code).beyond_armv6m, "{code:x?}");
        }
    }

    #[test]
    fn recognizes_masks_and_events() {
        assert!(parse(&[0xb672]).masks, "cpsid i");
        assert!(parse(&[0xf380, 0x8811]).masks, "msr basepri, r0");
        assert!(!parse(&[0xf380, 0x8809]).masks, "msr psp, r0");
        assert!(parse(&[0xbf40]).sends_event, "sev");
        assert!(parse(&[0x2001, 0xbf20]).waits_for_event, "movs r0, #1; wfe");
        // The second half of a long instruction is none by itself: ldr.w r11, [r15, #0xf40]
        assert!(!parse(&[0xf8df, 0xbf40]).sends_event);
    }
}
