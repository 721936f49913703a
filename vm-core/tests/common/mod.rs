//! Images built by hand, and a host that records.
#![allow(dead_code, reason = "each test file uses its part")]

use bittybuzz_vm_core::image::{EntryPoint, MAGIC, VERSION};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Arguments, Axis, ByteCode, Host, Item, Refusal, Reply, RobotFault, Value};

/// Parts of an image; `build` lays them out as docs/image-format.md says.
#[derive(Clone)]
pub struct Parts {
    pub form: u8,
    pub features: u8,
    pub entries: [EntryPoint; 4],
    pub globals: u8,
    pub imports: Vec<u16>,
    pub strings: Vec<&'static str>,
    pub libraries: Vec<[u8; 4]>,
    /// Header and code of each function.
    pub functions: Vec<Vec<u8>>,
}

impl Parts {
    /// A tiny image of these functions.
    pub fn new(functions: &[&[u8]]) -> Parts {
        Parts {
            form: VERSION,
            features: 0,
            entries: [EntryPoint::None; 4],
            globals: 2,
            imports: vec![],
            strings: vec![],
            libraries: vec![],
            functions: functions.iter().map(|f| f.to_vec()).collect(),
        }
    }

    pub fn build(&self) -> Vec<u8> {
        let mut bytes = vec![MAGIC, self.form, self.features, 1, 2, 3, 4];
        bytes.extend(self.entries.iter().map(|entry| entry.to_count() as u8));
        bytes.extend([
            self.globals,
            self.functions.len() as u8,
            self.imports.len() as u8,
            self.strings.len() as u8,
        ]);
        bytes.extend(self.imports.iter().flat_map(|hash| hash.to_le_bytes()));
        if self.form & bittybuzz_vm_core::image::FORM_LIBRARIES != 0 {
            bytes.push(self.libraries.len() as u8);
            bytes.extend(self.libraries.iter().flatten());
        }
        let mut at = 0u16;
        for function in &self.functions {
            bytes.extend(at.to_le_bytes());
            at += function.len() as u16;
        }
        if self.form & bittybuzz_vm_core::image::FORM_TEXT != 0 {
            for text in &self.strings {
                bytes.push(text.len() as u8);
                bytes.extend(text.as_bytes());
            }
        }
        bytes.extend(self.functions.iter().flatten());
        bytes
    }
}

/// Writes down what the script asks for. Robot function 7 waits twice before it answers 70.
#[derive(Default)]
pub struct Recorder {
    pub events: Vec<String>,
    pub polls: u32,
}

impl<P: Profile> Host<P> for Recorder {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        if function == 9 {
            return Err(RobotFault::Refused(Refusal::NotBuiltIn));
        }
        if function == 7 {
            self.polls += 1;
            assert_eq!(again, self.polls > 1);
            return Ok(if self.polls < 3 { Reply::Wait } else { Reply::Value(Value::int(70)) });
        }
        let text: Vec<String> = (0..arguments.count()).map(|i| show(arguments.item(i))).collect();
        self.events.push(format!("{function}({})", text.join(", ")));
        Ok(Reply::Value(Value::int(function.into())))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        let text: Vec<String> = (0..arguments.count()).map(|i| show(arguments.item(i))).collect();
        self.events.push(text.join(" "));
    }

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }
}

fn show<P: Profile, C: ByteCode, const SLOTS: usize>(item: Item<'_, P, C, SLOTS>) -> String {
    match item {
        Item::Nil => "nil".into(),
        Item::Int(value) => value.to_string(),
        Item::Float(value) => format!("{value:?}"),
        Item::String(text) => match text.number() {
            Some(number) => format!("string {number}"),
            #[cfg(not(feature = "strings"))]
            None => unreachable!("every string is a constant"),
            #[cfg(feature = "strings")]
            None => String::from_utf8_lossy(&text.bytes().collect::<Vec<u8>>()).into(),
        },
        Item::Table(size) => format!("table of {size}"),
        Item::Function => "function".into(),
    }
}
