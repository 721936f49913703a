//! Images laid out by hand, for what the compiler never writes.

use bittybuzz_vm_core::image::{EntryPoint, FORM_LIBRARIES, FORM_TEXT, MAGIC, VERSION};

/// Parts of an image, which [`ImageParts::build`] lays out as docs/image-format.md says.
#[derive(Debug, Clone)]
pub struct ImageParts {
    /// Version and form.
    pub form: u8,
    /// Features of the machine that it needs.
    pub features: u8,
    /// Functions that the host begins.
    pub entries: [EntryPoint; 4],
    /// The number of globals.
    pub globals: u8,
    /// The stigmergy table, three numbers or none.
    pub stigmergies: Vec<u16>,
    /// Hashes of robot functions.
    pub imports: Vec<u16>,
    /// Constant strings.
    pub strings: Vec<&'static str>,
    /// Libraries.
    pub libraries: Vec<[u8; 4]>,
    /// Classes of value for each string and for all other names.
    pub classes: Vec<u8>,
    /// Header and code of each function.
    pub functions: Vec<Vec<u8>>,
}

impl ImageParts {
    /// Returns a tiny image of these functions.
    pub fn new(functions: &[&[u8]]) -> Self {
        ImageParts {
            form: VERSION,
            features: 0,
            entries: [EntryPoint::None; 4],
            globals: 2,
            stigmergies: vec![],
            imports: vec![],
            strings: vec![],
            libraries: vec![],
            classes: vec![],
            functions: functions.iter().map(|f| f.to_vec()).collect(),
        }
    }

    /// Returns the bytes of the image.
    pub fn build(&self) -> Vec<u8> {
        let mut bytes = vec![MAGIC, self.form, self.features, 1, 2, 3, 4];
        bytes.extend(self.entries.iter().map(|entry| entry.to_count() as u8));
        bytes.extend([
            self.globals,
            self.functions.len() as u8,
            self.imports.len() as u8,
            self.strings.len() as u8,
        ]);
        bytes.extend(self.stigmergies.iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend(self.imports.iter().flat_map(|hash| hash.to_le_bytes()));
        if self.form & FORM_LIBRARIES != 0 {
            bytes.push(self.libraries.len() as u8);
            bytes.extend(self.libraries.iter().flatten());
        }
        bytes.extend(&self.classes);
        let mut at = 0u16;
        for function in &self.functions {
            bytes.extend(at.to_le_bytes());
            at += function.len() as u16;
        }
        if self.form & FORM_TEXT != 0 {
            for text in &self.strings {
                bytes.push(text.len() as u8);
                bytes.extend(text.as_bytes());
            }
        }
        bytes.extend(self.functions.iter().flatten());
        bytes
    }
}
