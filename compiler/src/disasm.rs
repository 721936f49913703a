//! The disassembler: prints images as readable text.
//!
//! The input may be any bytes. Bytes that cannot be decoded are reported as such, and no length or
//! offset is trusted.

use std::fmt::Write as _;

use bittybuzz_vm_core::builtin::{self, Feature, Library};
use bittybuzz_vm_core::class;
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::image::{
    ALL_CLASSES, CAPTURES, EntryPoint, Image, ImageHeader, PARAMETERS, USES_SELF,
};
use bittybuzz_vm_core::message::STIGMERGIES;
use bittybuzz_vm_core::number::{Full, Profile as _, Tiny};
use bittybuzz_vm_core::opcode::{self, DROP_RESULT, Decoded, Operand, Trailer};

use crate::image::ENTRIES;
use crate::symbols::{SourceSpan, Symbols};

/// Returns the image as text. With symbols, the text contains the names of functions and globals,
/// and source lines.
pub fn disassemble(image: &[u8], symbols: Option<&Symbols>) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = match Image::new(image).header() {
        Ok(header) => {
            let view = View { image, header, symbols };
            view.write(&mut text)
        }
        Err(error) => writeln!(text, "not an image: {error:?}"),
    };
    text
}

struct View<'a> {
    image: &'a [u8],
    header: ImageHeader,
    symbols: Option<&'a Symbols>,
}

impl View<'_> {
    fn write(&self, out: &mut String) -> std::fmt::Result {
        self.write_header(out)?;
        let first = usize::from(self.header.code_at());
        let start_of = |number| first + usize::from(self.word(self.header.functions_at(), number));
        for number in 0..self.header.functions() {
            let start = start_of(number);
            let next = number.checked_add(1).filter(|next| *next < self.header.functions());
            let end = next.map_or(self.image.len(), start_of).min(self.image.len());
            writeln!(out)?;
            // Without this check, overlapping functions could list the same bytes any number of
            // times.
            if start > end {
                return writeln!(out, "function {number} starts after its end");
            }
            self.write_function(out, number, start, end)?;
        }
        Ok(())
    }

    fn write_header(&self, out: &mut String) -> std::fmt::Result {
        let header = &self.header;
        let profile = if header.is_full() { "full" } else { "tiny" };
        writeln!(out, "profile      {profile}")?;
        writeln!(out, "script hash  {:08x}", header.hash())?;
        writeln!(out, "bytes        {} ({} code)", self.image.len(), self.code_length())?;
        let features = [
            (Feature::Maths, "maths"),
            (Feature::Strings, "strings"),
            (Feature::Neighbors, "neighbors"),
            (Feature::Swarm, "swarm"),
            (Feature::Stigmergy, "stigmergy"),
            (Feature::LongMessages, "long messages"),
        ];
        let needed: Vec<&str> = features
            .into_iter()
            .filter(|(feature, _)| header.features() & *feature as u8 != 0)
            .map(|(_, name)| name)
            .collect();
        writeln!(out, "features     {}", list(&needed))?;
        for (name, count) in ENTRIES.into_iter().zip(header.entries()) {
            match EntryPoint::from_count(count) {
                EntryPoint::None => {}
                EntryPoint::Function(number) => {
                    writeln!(out, "{name:<12} {}", self.function_name(number))?;
                }
                EntryPoint::Global(number) => {
                    writeln!(out, "{name:<12} global {}", self.global_name(number))?;
                }
            }
        }
        writeln!(out, "globals      {}", header.globals())?;
        if let Some(at) = header.stigmergies_at() {
            for number in 0..STIGMERGIES {
                let listed = self.word(at, number);
                writeln!(out, "stigmergy {number:<2} {listed}")?;
            }
        }
        for number in 0..header.imports() {
            writeln!(out, "import {number:<5} {}", self.import_name(number))?;
        }
        for number in 0..header.strings() {
            let number = number.saturating_add(builtin::string::COUNT);
            writeln!(out, "string {number:<5} {}", self.string_name(number))?;
        }
        if header.has_order() {
            writeln!(out, "order table")?;
        }
        if header.has_text() {
            writeln!(out, "text")?;
        }
        self.write_classes(out)?;
        for row in 0..header.library_rows() {
            let at = usize::from(header.libraries_at()) + 4 * usize::from(row);
            let string = u16::from_le_bytes([self.byte(at + 1), self.byte(at + 2)]);
            writeln!(
                out,
                "member       {}.{} = {}",
                library_name(self.byte(at)),
                self.string_name(string),
                builtin_name(i32::from(self.byte(at + 3)))
            )?;
        }
        Ok(())
    }

    /// Prints the names under which the script does not send every class of value.
    fn write_classes(&self, out: &mut String) -> std::fmt::Result {
        let Some(at) = self.header.classes_at() else { return Ok(()) };
        let strings = self.header.strings();
        // The table holds the rows in reverse order of the string numbers.
        let at = |row: u16| usize::from(at) + usize::from(strings - row);
        for row in 0..=strings {
            let classes = self.byte(at(row));
            if classes == ALL_CLASSES {
                continue;
            }
            let name = match row {
                row if row == strings => "other names".to_owned(),
                row => self.string_name(row.saturating_add(builtin::string::COUNT)),
            };
            let known = [
                (class::NIL, "nil"),
                (class::NUMBER, "numbers"),
                (class::STRING, "strings"),
                (class::TABLE, "tables"),
                (class::FUNCTION, "functions"),
            ];
            let sent = known.iter().filter(|(class, _)| classes & class != 0);
            let sent: Vec<&str> = sent.map(|(_, name)| *name).collect();
            writeln!(out, "classes      {name}: {}", list(&sent))?;
        }
        Ok(())
    }

    fn write_function(
        &self,
        out: &mut String,
        number: u16,
        start: usize,
        end: usize,
    ) -> std::fmt::Result {
        let name = self.function_name(number);
        let head = self.byte(start);
        write!(
            out,
            "function {number}: {name}, {} parameters, {} slots",
            head & PARAMETERS,
            self.byte(start + 1)
        )?;
        write!(out, "{}", if head & CAPTURES != 0 { ", has captured values" } else { "" })?;
        writeln!(out, "{}", if head & USES_SELF != 0 { ", uses self" } else { "" })?;
        let mut at = start + 2;
        let mut place = None;
        while at < end {
            let bytes = [self.byte(at), self.byte(at + 1), self.byte(at + 2)];
            let instruction = opcode::decode(bytes);
            let offset = at.saturating_sub(usize::from(self.header.code_at()));
            let here = self.place(offset);
            let Some(info) = opcode::TABLE.iter().find(|info| info.byte == instruction.opcode)
            else {
                writeln!(out, "{offset:>5}: {:#04x} is no instruction", bytes[0])?;
                return Ok(());
            };
            let trailer = at + usize::from(instruction.length);
            let next = trailer + info.trailer.length(self.word_bytes());
            let operand = match info.operand {
                Operand::None => String::new(),
                Operand::Jump => {
                    let target = next as i64 + i64::from(instruction.operand);
                    format!(" {}", target - i64::from(self.header.code_at()))
                }
                _ => format!(" {}", instruction.operand),
            };
            let code = format!("{}{operand}{}", info.name, self.trailer(info.trailer, trailer));
            let mut comment = self.meaning(info, &instruction, trailer);
            if here.is_some() && here != place {
                place = here;
                if let Some(source) = here.and_then(|place| self.source(place)) {
                    let gap = if comment.is_empty() { "" } else { "  " };
                    comment = format!("{comment}{gap}[{source}]");
                }
            }
            let line = format!("{offset:>5}: {code:<24} ; {comment}");
            writeln!(out, "{}", line.trim_end_matches([' ', ';']))?;
            if next > end {
                writeln!(out, "       runs over the end of the function")?;
            }
            at = next;
        }
        Ok(())
    }

    /// Returns the name of the item that the operand selects.
    fn meaning(&self, info: &opcode::OpcodeInfo, instruction: &Decoded, trailer: usize) -> String {
        let number = instruction.operand;
        let index = u16::try_from(number).ok();
        let named = |name: &dyn Fn(u16) -> String| index.map_or_else(String::new, name);
        match info.operand {
            Operand::String => named(&|n| self.string_name(n)),
            Operand::Function => named(&|n| self.function_name(n)),
            Operand::Builtin => builtin_name(i32::from(number)),
            Operand::Robot => named(&|n| self.import_name(n)),
            Operand::Library => u8::try_from(number).map_or_else(|_| "?".to_owned(), library_name),
            Operand::Global => named(&|n| self.global_name(n)),
            Operand::None if matches!(info.trailer, Trailer::Word | Trailer::Half) => {
                self.literal(instruction.opcode, trailer)
            }
            _ => String::new(),
        }
    }

    fn trailer(&self, trailer: Trailer, at: usize) -> String {
        let byte = self.byte(at);
        match trailer {
            Trailer::None | Trailer::Word | Trailer::Half => String::new(),
            Trailer::Arguments if byte & DROP_RESULT != 0 => {
                format!(" {} drop", byte & !DROP_RESULT)
            }
            Trailer::Arguments | Trailer::Captures => format!(" {byte}"),
            Trailer::Immediate => format!(" {}", byte as i8),
            Trailer::LocalImmediate => {
                let (jump, local) = opcode::relation_of_local(byte);
                let name = opcode::info(jump).map_or("?", |info| info.name);
                let relation = name.trim_start_matches("JUMP_").trim_end_matches("_INT");
                let immediate = i16::from_le_bytes([self.byte(at + 1), self.byte(at + 2)]);
                format!(" {relation} {local} {immediate}")
            }
        }
    }

    fn literal(&self, opcode: u8, at: usize) -> String {
        let mut bytes = [self.byte(at), self.byte(at + 1), self.byte(at + 2), self.byte(at + 3)];
        if opcode == opcode::FLOAT_HALF && self.header.is_full() {
            let [low, high, ..] = bytes;
            bytes = [0, 0, low, high];
        }
        let (int, float) = if self.header.is_full() {
            let raw = Full::literal_from_le(bytes);
            (Full::int_to_i32(raw), Full::float_to_f32(raw))
        } else {
            let raw = Tiny::literal_from_le(bytes);
            (Tiny::int_to_i32(raw), Tiny::float_to_f32(raw))
        };
        if opcode == opcode::INT_WORD { int.to_string() } else { format!("{float:?}") }
    }

    fn word_bytes(&self) -> usize {
        if self.header.is_full() { Full::WORD_BYTES } else { Tiny::WORD_BYTES }
    }

    fn byte(&self, at: usize) -> u8 {
        self.image.get(at).copied().unwrap_or(0)
    }

    fn word(&self, table: u16, row: u16) -> u16 {
        let at = usize::from(table) + 2 * usize::from(row);
        u16::from_le_bytes([self.byte(at), self.byte(at + 1)])
    }

    fn code_length(&self) -> usize {
        self.image.len().saturating_sub(usize::from(self.header.code_at()))
    }

    fn place(&self, offset: usize) -> Option<SourceSpan> {
        self.symbols?.position(u32::try_from(offset).ok()?)
    }

    fn source(&self, place: SourceSpan) -> Option<String> {
        let file = self.symbols?.file(place.file)?;
        Some(format!("{file}:{}:{}", place.line, place.column))
    }

    fn function_name(&self, number: u16) -> String {
        let known = self.symbols.and_then(|symbols| symbols.functions.get(usize::from(number)));
        known.map_or_else(|| format!("function {number}"), |function| function.name.clone())
    }

    fn global_name(&self, number: u16) -> String {
        let known = self.symbols.and_then(|symbols| symbols.globals.get(usize::from(number)));
        known.cloned().unwrap_or_else(|| number.to_string())
    }

    fn import_name(&self, number: u16) -> String {
        let hash = self.word(self.header.imports_at(), number);
        let known = self.symbols.and_then(|symbols| symbols.imports.get(usize::from(number)));
        match known.filter(|name| name_hash(name) == hash) {
            Some(name) => name.clone(),
            None => format!("robot function {hash:#06x}"),
        }
    }

    fn string_name(&self, number: u16) -> String {
        let own = builtin::STRINGS.get(usize::from(number)).copied();
        let text = own.or_else(|| self.symbols?.string(number)).map(str::to_owned);
        text.or_else(|| self.image_text(number))
            .map_or_else(|| format!("string {number}"), |t| format!("{t:?}"))
    }

    /// Returns the text of a string if the image holds it.
    fn image_text(&self, number: u16) -> Option<String> {
        if !self.header.has_text() {
            return None;
        }
        let index = number.checked_sub(builtin::string::COUNT)?;
        let mut at = usize::from(self.header.text_at());
        for current in 0..self.header.strings() {
            let first = self.byte(at);
            at += 1;
            let mut length = usize::from(first);
            if first & 0x80 != 0 {
                length = usize::from(first & 0x7f) << 8 | usize::from(self.byte(at));
                at += 1;
            }
            if current == index {
                return Some(
                    String::from_utf8_lossy(self.image.get(at..at + length)?).into_owned(),
                );
            }
            at += length;
        }
        None
    }
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn library_name(number: u8) -> String {
    match Library::ALL.get(usize::from(number)) {
        Some(library) => match library.global_name() {
            Some(name) => name.to_owned(),
            None => format!("{library:?}"),
        },
        None => format!("library {number}"),
    }
}

fn builtin_name(number: i32) -> String {
    let Some(info) = u8::try_from(number).ok().and_then(builtin::info) else {
        return format!("built-in {number}");
    };
    match info.library {
        Library::Global => info.name.to_owned(),
        Library::Rng => format!("math.rng.{}", info.name),
        library => match library.global_name() {
            Some(global) => format!("{global}.{}", info.name),
            None => format!("{library:?}.{}", info.name),
        },
    }
}
