//! docs/instruction-set.md is written from the tables of the crate. `UPDATE_DOCS=1 cargo test` writes it anew.

use std::fmt::Write;

use bittybuzz_vm_core::builtin::{self, Kind, Library};
use bittybuzz_vm_core::opcode::{Operand, SHORTS, TABLE, Trailer};

const INTRODUCTION: &str = "\
# The instruction set

Written from `vm-core/src/opcode.rs` and `vm-core/src/builtin.rs`; do not edit. How instructions stand in an image:
[image-format.md](image-format.md).

An instruction is one byte, then its operand, then its trailer. Bytes `0x00` to `0x3f` have no operand. `0x40` to `0x7f` have an operand of one
signed byte; with bit 7 set, `0xc0` to `0xff`, one of two bytes, little-endian. `0x80` to `0xbf` are short forms that hold their
operand. A jump counts from the end of the instruction. `a b -- c`: b is on top, c takes their place.
";

#[test]
fn instruction_set_is_up_to_date() {
    let mut text = String::from(INTRODUCTION);
    text.push_str(
        "\n| Byte | Instruction | Operand | Trailer | Stack and meaning |\n|---|---|---|---|---|\n",
    );
    for info in TABLE {
        let operand = match info.operand {
            Operand::None => "",
            Operand::Int => "integer",
            Operand::String => "string",
            Operand::Function => "function",
            Operand::Builtin => "built-in",
            Operand::Robot => "robot function",
            Operand::Library => "library",
            Operand::Local => "local",
            Operand::Global => "global",
            Operand::Capture => "captured value",
            Operand::Count => "count",
            Operand::Parameters => "parameters of this function",
            Operand::Jump => "distance",
        };
        let trailer = match info.trailer {
            Trailer::None => "",
            Trailer::Arguments => "arguments; bit 7: drop the result",
            Trailer::Captures => "captured values",
            Trailer::Immediate => "signed byte",
            Trailer::LocalImmediate => {
                "relation in the high half, local + 4 in the low half; signed byte"
            }
            Trailer::Word => "2 bytes (`tiny`) or 4 (`full`)",
        };
        let meaning = info.meaning.replace('|', "\\|");
        let (byte, name) = (info.byte, info.name);
        writeln!(text, "| `{byte:#04x}` | `{name}` | {operand} | {trailer} | {meaning} |").unwrap();
    }
    text.push_str("\n## Short forms\n| Bytes | Stand for |\n|---|---|\n");
    for form in SHORTS {
        let name = TABLE.iter().find(|info| info.byte == form.opcode).unwrap().name;
        let last = form.first + form.count - 1;
        let high = form.low + i16::from(form.count) - 1;
        writeln!(
            text,
            "| `{:#04x}` to `{last:#04x}` | `{name}` {} to {high} |",
            form.first, form.low
        )
        .unwrap();
    }
    text.push_str("\n## Libraries\n| Number | Name |\n|---|---|\n");
    for library in Library::ALL {
        let name = match library {
            Library::Global => "(no library)",
            Library::Rng => "`math.rng`",
            Library::SwarmObject => "what `swarm.create` returns",
            Library::StigmergyObject => "what `stigmergy.create` returns",
            other => &format!("`{}`", other.global_name().unwrap()),
        };
        writeln!(text, "| {} | {name} |", library as u8).unwrap();
    }
    text.push_str("\n## Built-ins\n| Number | Arguments | Kind | Meaning |\n|---|---|---|---|\n");
    for info in builtin::TABLE {
        let arguments = match (info.kind, info.min, info.max) {
            (Kind::Value, ..) => String::new(),
            (_, min, 255) => format!("{min} or more"),
            (_, min, max) if min == max => min.to_string(),
            (_, min, max) => format!("{min} to {max}"),
        };
        let kind = match info.kind {
            Kind::Plain => "at once",
            Kind::Calls => "calls or waits",
            Kind::Value => "value",
        };
        writeln!(text, "| {} | {arguments} | {kind} | `{}` |", info.number, info.help).unwrap();
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/instruction-set.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(written == text, "{path} is out of date: run UPDATE_DOCS=1 cargo test");
}
