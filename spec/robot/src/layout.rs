//! The places of firmware, script and data on the chip.

use std::fmt::Write;

use bittybuzz_vm_core::message::crc16;
use bittybuzz_vm_core::{longest_image, seal};

/// Bytes of a robot's id, or of a setting, in flash.
const NUMBER_BYTES: usize = 4;

/// Bytes before the image in the script region: its length as a `u32`, or its length and a checksum (`bittybuzz_runtime::section`).
const SCRIPT_HEADER: u32 = 4;

/// Bytes of a place in a log of scripts, and of the mark at the end of a place
/// (`bittybuzz_runtime::places`).
pub(crate) const PLACE: u32 = 4096;
const MARK: u32 = 8;

/// Sequence number of a script that is written together with its copy, which leaves no older
/// script.
const SEQUENCE: u32 = 1;

/// Regions of a chip's memory, which do not overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Flash of the firmware, starting with its vector table.
    pub application: Region,
    /// Flash of the script: a header, then the image. The region shares no erasable sector with the
    /// firmware. The header is the length of the image (a `u16`, least significant byte first) and
    /// a checksum; see `bittybuzz_runtime::section`.
    pub script: Region,
    /// True if the script region is a log: two sectors of equal size with places of 4 KiB. The
    /// newest complete place is used, so that a loss of power during a write leaves a script. See
    /// `bittybuzz_runtime::places`.
    pub script_log: bool,
    /// True if the script's image has a seal, which the firmware checks in place of the code
    /// ([`seal`]). Tools then verify the image, and append the seal.
    pub script_sealed: bool,
    /// RAM for variables.
    pub ram: Region,
    /// RAM for the stack alone. With no memory below it, a stack overflow is a fault and damages no
    /// variable. `None` if the stack grows down from the end of `ram`.
    pub stack: Option<Region>,
    /// Flash of the robot's id, in an erasable sector of its own: see [`Layout::id_section`].
    /// `None` if no id can be assigned.
    pub id: Option<Region>,
    /// Flash of the robot's settings, in an erasable sector of its own: see
    /// [`Layout::settings_section`]. `None` if there are none.
    pub settings: Option<Region>,
}

/// A region of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// The address of the first byte.
    pub address: u32,
    /// The size in bytes. The region ends within the address space.
    pub size: u32,
}

impl Region {
    /// Returns the address after the last byte.
    pub const fn end(self) -> u32 {
        self.address + self.size
    }

    /// Returns true if the region contains all of another one.
    pub const fn contains(self, other: Region) -> bool {
        match other.address.checked_add(other.size) {
            Some(end) => self.address <= other.address && end <= self.end(),
            None => false,
        }
    }

    /// Returns true if the regions have a byte in common.
    pub const fn overlaps(self, other: Region) -> bool {
        self.address < other.end() && other.address < self.end()
    }
}

impl Layout {
    /// Returns every region with its name in the linker script.
    pub fn regions(&self) -> impl Iterator<Item = (&'static str, Region)> {
        let stack = self.stack.map(|stack| ("STACK", stack));
        let id = self.id.map(|id| ("ID", id));
        let settings = self.settings.map(|settings| ("SETTINGS", settings));
        [("FLASH", self.application), ("SCRIPT", self.script), ("RAM", self.ram)]
            .into_iter()
            .chain(stack)
            .chain(id)
            .chain(settings)
    }

    /// Returns the first bytes of the id region: the id and its complement, each a `u16`, least
    /// significant byte first. The complement distinguishes an id from erased flash.
    pub fn id_section(id: u16) -> [u8; NUMBER_BYTES] {
        let [[a, b], [c, d]] = [id.to_le_bytes(), (!id).to_le_bytes()];
        [a, b, c, d]
    }

    /// Returns the first bytes of the settings region. Each setting is encoded like the id, and is
    /// erased if it has no value.
    pub fn settings_section(values: &[Option<u16>]) -> Vec<u8> {
        let bytes = |value: &Option<u16>| value.map_or([u8::MAX; NUMBER_BYTES], Layout::id_section);
        values.iter().flat_map(bytes).collect()
    }

    /// Returns the size in bytes of the longest image that a script may have. The seal is not
    /// counted.
    pub const fn most_script(&self) -> u32 {
        let seal = if self.script_sealed { seal::LENGTH as u32 } else { 0 };
        self.room().saturating_sub(seal)
    }

    /// Returns the number of bytes that the script region has for an image and its seal. The
    /// firmware reads them as a [`FlashArea`](bittybuzz_vm_core::FlashArea).
    const fn room(&self) -> u32 {
        let region = if self.script_log { PLACE - MARK } else { self.script.size };
        let longest = longest_image((region - SCRIPT_HEADER) as usize) as u32;
        if longest < u16::MAX as u32 { longest } else { u16::MAX as u32 }
    }

    /// Returns the bytes of the script region for an image, with its seal if it needs one, or of a
    /// place in its log; `None` if the image does not fit.
    pub fn script_section(&self, image: &[u8]) -> Option<Vec<u8>> {
        let length = u32::try_from(image.len()).ok()?;
        if length > self.room() {
            return None;
        }
        let header = if self.script_log {
            length.to_le_bytes()
        } else {
            let length = u16::try_from(length).expect("the room is at most `u16::MAX`");
            let [low, high] = length.to_le_bytes();
            let check = image.iter().fold(0xffff, |check, byte| crc16(check, *byte));
            let [first, second] = check.to_le_bytes();
            [low, high, first, second]
        };
        let mut section = [&header, image].concat();
        if self.script_log {
            let mark = Self::script_mark(image);
            section.resize((PLACE - MARK) as usize, u8::MAX);
            section.extend(mark);
        }
        Some(section)
    }

    /// Returns the mark at the end of a place, which makes the script in the place complete. The
    /// mark must be written last.
    pub fn script_mark(image: &[u8]) -> [u8; MARK as usize] {
        let length = (image.len() as u32).to_le_bytes();
        let sequence = SEQUENCE.to_le_bytes();
        let content = length.iter().chain(image).chain(&sequence);
        let check = content.fold(0xffff, |check, byte| crc16(check, *byte));
        let ([a, b, c, d], [e, f], [g, h]) =
            (sequence, check.to_le_bytes(), (!check).to_le_bytes());
        [a, b, c, d, e, f, g, h]
    }

    /// Returns the addresses of [`script_section`](Self::script_section), in the order of writing.
    /// A log has one at the beginning of each sector, so that one of them always holds a complete
    /// script.
    pub fn script_addresses(&self) -> Vec<u32> {
        let Region { address, size } = self.script;
        if self.script_log { vec![address, address + size / 2] } else { vec![address] }
    }

    /// Returns the `memory.x` that cortex-m-rt's linker script includes.
    ///
    /// The section `.script` is in the script region. With a log, `.script_mark` is at the end of
    /// its first place, and `.script_copy` and `.script_copy_mark` are in the second sector.
    pub fn memory_x(&self) -> String {
        let mut out = String::new();
        self.write_memory_x(&mut out).expect("writing to a string cannot fail");
        out
    }

    fn write_memory_x(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "MEMORY\n{{")?;
        for (name, Region { address, size }) in self.regions() {
            writeln!(out, "  {name} : ORIGIN = {address:#010x}, LENGTH = {size:#x}")?;
        }
        // Because each part has a region of its own, the bytes between them are not part of the
        // program and stay erased.
        let script = self.script.address;
        let (mark, copy) = (PLACE - MARK, self.script.size / 2);
        let parts =
            [("SCRIPT_MARK", mark), ("SCRIPT_COPY", copy), ("SCRIPT_COPY_MARK", copy + mark)];
        let parts = if self.script_log { &parts[..] } else { &[] };
        for (name, offset) in parts {
            let (address, size) = (script + offset, PLACE - offset % PLACE);
            writeln!(out, "  {name} : ORIGIN = {address:#010x}, LENGTH = {size:#x}")?;
        }
        writeln!(out, "}}")?;
        if self.stack.is_some() {
            writeln!(out, "_stack_start = ORIGIN(STACK) + LENGTH(STACK);")?;
            writeln!(out, "_stack_end = ORIGIN(STACK);")?;
        }
        writeln!(out, "SECTIONS\n{{\n  .script : ALIGN(4) {{ KEEP(*(.script)); }} > SCRIPT")?;
        for (region, _) in parts {
            let name = region.to_lowercase();
            writeln!(out, "  .{name} : {{ KEEP(*(.{name})); }} > {region}")?;
        }
        writeln!(out, "}}\nINSERT AFTER .rodata;")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> Layout {
        let region = |address, size| Region { address, size };
        Layout {
            application: region(0x0800_4000, 0x1_c000),
            script: region(0x0802_0000, 14),
            script_log: false,
            script_sealed: false,
            ram: region(0x2000_0000, 0x2_0000),
            stack: Some(region(0x1000_0000, 0x1_0000)),
            id: Some(region(0x0804_0000, 0x2_0000)),
            settings: Some(region(0x0806_0000, 0x400)),
        }
    }

    /// CRC-16/MCRF4XX, bit by bit: reflected polynomial 0x8408.
    fn reference_crc(bytes: &[u8]) -> u16 {
        bytes.iter().fold(0xffff, |check, byte| {
            (0..8).fold(check ^ u16::from(*byte), |check, _| {
                check >> 1 ^ if check & 1 == 1 { 0x8408 } else { 0 }
            })
        })
    }

    #[test]
    fn the_script_section_is_length_checksum_and_image() {
        let layout = layout();
        let [low, high] = reference_crc(&[7, 8]).to_le_bytes();
        assert_eq!(layout.script_section(&[7, 8]), Some(vec![2, 0, low, high, 7, 8]));
        assert_eq!(layout.script_section(&[1; 8]).map(|section| section.len()), Some(12));
        assert_eq!(layout.script_section(&[1; 9]), None);
    }

    /// The firmware reads at most a power of two, with two bytes after it: of 70 bytes, 64.
    #[test]
    fn the_seal_takes_its_bytes_from_the_longest_script() {
        let script = Region { address: 0x0802_0000, size: 4 + 70 };
        let verified = Layout { script, ..layout() };
        let sealed = Layout { script_sealed: true, ..verified };
        assert_eq!((verified.most_script(), sealed.most_script()), (64, 34));
        for layout in [verified, sealed] {
            assert_eq!(layout.script_section(&[7; 64]).map(|section| section.len()), Some(68));
            assert_eq!(layout.script_section(&[7; 65]), None);
        }
        assert_eq!(Layout { script_sealed: true, ..layout() }.most_script(), 0);
    }

    #[test]
    fn a_log_has_places_with_a_mark_and_a_copy() {
        let script = Region { address: 0x080a_0000, size: 0x4_0000 };
        let layout = Layout { script, script_log: true, ..layout() };
        let section = layout.script_section(&[7, 8]).unwrap();
        assert_eq!(section.len(), 4096);
        assert_eq!(section[..8], [2, 0, 0, 0, 7, 8, 0xff, 0xff]);
        assert_eq!(section[4084..4092], [0xff, 0xff, 0xff, 0xff, 1, 0, 0, 0]);
        assert_eq!(section[4088..], Layout::script_mark(&[7, 8]));
        let check = reference_crc(&[2, 0, 0, 0, 7, 8, 1, 0, 0, 0]);
        assert_eq!(section[4092..], [&check.to_le_bytes()[..], &(!check).to_le_bytes()].concat());
        assert_eq!(layout.script_addresses(), [0x080a_0000, 0x080c_0000]);
        let text = layout.memory_x();
        for line in [
            "  SCRIPT_MARK : ORIGIN = 0x080a0ff8, LENGTH = 0x8\n",
            "  SCRIPT_COPY : ORIGIN = 0x080c0000, LENGTH = 0x1000\n",
            "  SCRIPT_COPY_MARK : ORIGIN = 0x080c0ff8, LENGTH = 0x8\n",
            "  .script_mark : { KEEP(*(.script_mark)); } > SCRIPT_MARK\n",
            "  .script_copy : { KEEP(*(.script_copy)); } > SCRIPT_COPY\n",
            "  .script_copy_mark : { KEEP(*(.script_copy_mark)); } > SCRIPT_COPY_MARK\n",
        ] {
            assert!(text.contains(line), "{line}{text}");
        }
    }

    #[test]
    fn erased_flash_is_no_id() {
        assert_eq!(Layout::id_section(0x1234), [0x34, 0x12, 0xcb, 0xed]);
        assert!((0..=u16::MAX).all(|id| Layout::id_section(id) != [0xff; 4]));
    }

    #[test]
    fn settings_without_a_value_are_erased() {
        let section = Layout::settings_section(&[None, Some(0x0102)]);
        assert_eq!(section, [0xff, 0xff, 0xff, 0xff, 2, 1, 0xfd, 0xfe]);
    }

    #[test]
    fn memory_x_has_every_region() {
        let text = layout().memory_x();
        for line in [
            "  FLASH : ORIGIN = 0x08004000, LENGTH = 0x1c000\n",
            "  SCRIPT : ORIGIN = 0x08020000, LENGTH = 0xe\n",
            "  RAM : ORIGIN = 0x20000000, LENGTH = 0x20000\n",
            "  STACK : ORIGIN = 0x10000000, LENGTH = 0x10000\n",
            "  ID : ORIGIN = 0x08040000, LENGTH = 0x20000\n",
            "  SETTINGS : ORIGIN = 0x08060000, LENGTH = 0x400\n",
            "_stack_start = ORIGIN(STACK) + LENGTH(STACK);\n",
        ] {
            assert!(text.contains(line), "{line}{text}");
        }
        let text = Layout { stack: None, ..layout() }.memory_x();
        assert!(!text.contains("STACK") && !text.contains("_stack_start"), "{text}");
    }

    #[test]
    fn a_region_contains_itself_and_nothing_beyond() {
        let region = |address, size| Region { address, size };
        let whole = region(0x100, 0x10);
        assert!(whole.contains(whole) && whole.contains(region(0x10f, 1)));
        assert!(!whole.contains(region(0xff, 2)) && !whole.contains(region(0x10f, 2)));
        assert!(!whole.contains(region(0x108, u32::MAX)));
    }

    #[test]
    fn neighboring_regions_do_not_overlap() {
        let region = |address, size| Region { address, size };
        assert!(!region(0, 4).overlaps(region(4, 4)) && !region(4, 4).overlaps(region(0, 4)));
        assert!(region(0, 5).overlaps(region(4, 4)) && region(4, 4).overlaps(region(0, 5)));
        assert!(region(0, 16).overlaps(region(4, 4)) && region(4, 4).overlaps(region(0, 16)));
    }
}
