//! Where firmware, script and data lie on the chip.

use std::fmt::Write;

/// Bytes of a robot's id, or of a setting, in flash.
const NUMBER_BYTES: usize = 4;

/// Bytes before the image in the script region: its length, a `u32`, least significant byte first.
const SCRIPT_HEADER: u32 = 4;

/// Regions of a chip's memory, none overlapping another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Flash of the firmware, from its vector table on.
    pub application: Region,
    /// Flash of the script, which no part of the firmware shares an erasable sector with: the length of the image (a
    /// `u32`, least significant byte first), then the image.
    pub script: Region,
    /// RAM for variables.
    pub ram: Region,
    /// RAM for the stack alone, best with no memory below, so that a full stack is a fault and damages no variable. `None`
    /// if the stack grows down from the end of `ram`.
    pub stack: Option<Region>,
    /// Flash of the robot's id, which nothing else shares an erasable sector with: see [`Layout::id_section`]. `None`
    /// where no id can be assigned.
    pub id: Option<Region>,
    /// Flash of the robot's settings, likewise: see [`Layout::settings_section`]. `None` where there are none.
    pub settings: Option<Region>,
}

/// A region of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// Its first byte.
    pub address: u32,
    /// How many bytes it has. It ends within the address space.
    pub size: u32,
}

impl Region {
    /// The address behind its last byte.
    pub const fn end(self) -> u32 {
        self.address + self.size
    }

    /// Whether all of another lies in it.
    pub const fn contains(self, other: Region) -> bool {
        match other.address.checked_add(other.size) {
            Some(end) => self.address <= other.address && end <= self.end(),
            None => false,
        }
    }

    /// Whether a byte lies in both.
    pub const fn overlaps(self, other: Region) -> bool {
        self.address < other.end() && other.address < self.end()
    }
}

impl Layout {
    /// Every region with its name in the linker script.
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

    /// The first bytes of the id region: the id and its complement, so that erased flash is none; each a `u16`, least
    /// significant byte first.
    pub fn id_section(id: u16) -> [u8; NUMBER_BYTES] {
        let [[a, b], [c, d]] = [id.to_le_bytes(), (!id).to_le_bytes()];
        [a, b, c, d]
    }

    /// The first bytes of the settings region: each setting as the id, erased where there is no value.
    pub fn settings_section(values: &[Option<u16>]) -> Vec<u8> {
        let bytes = |value: &Option<u16>| value.map_or([u8::MAX; NUMBER_BYTES], Layout::id_section);
        values.iter().flat_map(bytes).collect()
    }

    /// Bytes of the longest image that fits into the script region.
    pub const fn most_script(&self) -> u32 {
        self.script.size - SCRIPT_HEADER
    }

    /// The bytes of the script region for an image; `None` if it does not fit.
    pub fn script_section(&self, image: &[u8]) -> Option<Vec<u8>> {
        let length = u32::try_from(image.len()).ok()?;
        if length > self.most_script() {
            return None;
        }
        Some([&length.to_le_bytes(), image].concat())
    }

    /// The `memory.x` that cortex-m-rt's linker script includes.
    ///
    /// What is linked into the section `.script` goes to the script region.
    pub fn memory_x(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = self.write_memory_x(&mut out);
        out
    }

    fn write_memory_x(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "MEMORY\n{{")?;
        for (name, Region { address, size }) in self.regions() {
            writeln!(out, "  {name} : ORIGIN = {address:#010x}, LENGTH = {size:#x}")?;
        }
        writeln!(out, "}}")?;
        if self.stack.is_some() {
            writeln!(out, "_stack_start = ORIGIN(STACK) + LENGTH(STACK);")?;
            writeln!(out, "_stack_end = ORIGIN(STACK);")?;
        }
        writeln!(out, "SECTIONS\n{{\n  .script : ALIGN(4) {{ KEEP(*(.script)); }} > SCRIPT")?;
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
            script: region(0x0802_0000, 12),
            ram: region(0x2000_0000, 0x2_0000),
            stack: Some(region(0x1000_0000, 0x1_0000)),
            id: Some(region(0x0804_0000, 0x2_0000)),
            settings: Some(region(0x0806_0000, 0x400)),
        }
    }

    #[test]
    fn the_script_section_is_length_and_image() {
        let layout = layout();
        assert_eq!(layout.script_section(&[7, 8]), Some(vec![2, 0, 0, 0, 7, 8]));
        assert_eq!(layout.script_section(&[1; 8]).map(|section| section.len()), Some(12));
        assert_eq!(layout.script_section(&[1; 9]), None);
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
            "  SCRIPT : ORIGIN = 0x08020000, LENGTH = 0xc\n",
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
    fn neighbouring_regions_do_not_overlap() {
        let region = |address, size| Region { address, size };
        assert!(!region(0, 4).overlaps(region(4, 4)) && !region(4, 4).overlaps(region(0, 4)));
        assert!(region(0, 5).overlaps(region(4, 4)) && region(4, 4).overlaps(region(0, 5)));
        assert!(region(0, 16).overlaps(region(4, 4)) && region(4, 4).overlaps(region(0, 16)));
    }
}
