//! Images byte by byte, against the layout in docs/image-format.md.

use bittybuzz_compiler::asm::FunctionCode;
use bittybuzz_compiler::image::{BYTES_MAX, EntryPoint, ImageBuildError, ImageContent, LibraryRow};
use bittybuzz_compiler::strings::StringTable;
use bittybuzz_vm_core::builtin::{self, string};
use bittybuzz_vm_core::image::{Entry, FORM_ORDER, FORM_TEXT, Image, ImageHeader};

use crate::back::machine::{FULL, TINY, image, verify};

fn header(bytes: &[u8]) -> ImageHeader {
    Image::new(bytes).header().expect("an image")
}

#[test]
fn the_smallest_image() {
    let (bytes, symbols) = image("", TINY);
    let hash = symbols.script_hash.to_le_bytes();
    let expected = [
        &[0xb5, 0x02, 0x00][..],
        &hash,
        &[0, 0, 0, 0], // entries
        &[0, 1, 0, 0], // globals, functions, imports, strings
        &[0, 0],       // function table
        &[0, 0, 0xbc], // no parameters, no slots, RETURN_NIL
    ];
    assert_eq!(bytes, expected.concat());
    assert_eq!(image("", FULL).0[1], 0x82);
}

#[test]
fn a_whole_image_by_hand() {
    // Strings: "a" = 12, "b" = 13. Globals: t = 0, f = 1. Functions: global code 0, step 1.
    let script = "t = { .a = 1 }\nfunction step() { led(t.b) }\nf = step";
    let (bytes, symbols) = image(script, TINY);
    let hash = symbols.script_hash.to_le_bytes();
    let led = bittybuzz_vm_core::hash::name_hash("led").to_le_bytes();
    let expected = [
        &[0xb5, 0x02, 0x00][..],
        &hash,
        &[0, 3, 0, 0], // step is function 1: 1 + 2 * 1
        &[2, 2, 1, 2], // globals, functions, imports, strings
        &led,
        &[0, 0, 11, 0],                // function table
        &[0, 2],                       // global code: no parameters, 2 slots
        &[0x2f, 0x92, 0x4d, 12, 0xb0], // TABLE_NEW, INT 1, FIELD_INIT "a", GLOBAL_SET 0
        &[0x42, 1, 0xb1, 0xbc],        // FUNCTION 1, GLOBAL_SET 1, RETURN_NIL 0
        &[0, 1],                       // step: no parameters, 1 slot
        &[0xa0, 0x4b, 13],             // GLOBAL_GET 0, FIELD_GET "b"
        &[0x53, 0, 0x81, 0xbc],        // CALL_ROBOT 0, 1 argument, no result; RETURN_NIL 0
    ];
    assert_eq!(bytes, expected.concat());
    assert_eq!(verify(&bytes, TINY), Ok(()));
}

#[test]
fn counts_above_127_take_two_bytes() {
    let many: Vec<String> = (0..300).map(|n| format!("g{n} = {n}")).collect();
    let (bytes, symbols) = image(&many.join("\n"), FULL);
    assert_eq!(symbols.globals.len(), 300);
    assert_eq!(bytes[11..13], [0x81, 0x2c]);
    assert_eq!(header(&bytes).globals(), 300);
    assert_eq!(verify(&bytes, FULL), Ok(()));
}

#[test]
fn entries() {
    let entry = |script: &str, entry| header(&image(script, FULL).0).entry(entry);
    assert_eq!(entry("function init() { }", Entry::Init), EntryPoint::Function(1));
    assert_eq!(entry("function step() { }", Entry::Init), EntryPoint::None);
    assert_eq!(entry("function destroy() { }", Entry::Destroy), EntryPoint::Function(1));
    assert_eq!(entry("x = 1 y = x reset = function() { }", Entry::Reset), EntryPoint::Global(2));
    // Assigned later, a function is a variable with a first value.
    assert_eq!(entry("function step() { } step = step", Entry::Step), EntryPoint::Global(0));
}

#[test]
fn globals_used_most_come_first() {
    let (_, symbols) = image("rare = 1 often = 2 x = often + often + often unread = often", FULL);
    assert_eq!(symbols.globals, ["often", "rare", "x", "unread"]);
}

#[test]
fn strings_are_those_of_the_source_sorted_and_without_the_machines_own() {
    let script = "t = { .zebra = \"Apple\" } if(0) t.never = \"distance\" t[\"m\"] = t.data";
    let (bytes, symbols) = image(script, TINY);
    assert_eq!(symbols.strings, ["Apple", "m", "never", "zebra"]);
    assert_eq!(symbols.string(string::DATA), Some("data"));
    assert_eq!(symbols.string(string::COUNT), Some("Apple"));
    assert_eq!(symbols.string(string::COUNT + 4), None);
    assert_eq!(header(&bytes).strings(), 4);
}

#[test]
fn the_order_table_is_there_only_where_it_decides() {
    let form = |script: &str| header(&image(script, TINY).0).form() & FORM_ORDER != 0;
    // Two strings, one of them perhaps the machine's own.
    assert!(form("function f(a, b) { return a < b } log(f(type(1), \"x\"))"));
    assert!(form("function f(a, b) { return math.max(a, b) } log(f(\"data\", \"x\"))"));
    assert!(form("foreach({ .x = 1 }, function(k, v) { log(k < v) })"));
    assert!(form("type = type function f(a, b) { return a < b } log(f(type(1), \"x\"))"));
    // The script's own strings are ordered by their numbers.
    assert!(!form("function f(a, b) { return a < b } log(f(\"x\", \"y\"))"));
    // A number or nil on one side: strings would fault.
    assert!(!form(
        "function f(a) { return a < 1 or nil > a or a <= 1 + a } log(f(type(1)), \"x\")"
    ));
    assert!(!form("function f(a, b) { return a == b } log(f(type(1), \"x\"))"));
}

#[test]
fn text_comes_with_the_strings_feature() {
    let (bytes, _) = image("log(\"hello\")", FULL);
    assert_eq!(header(&bytes).form() & FORM_TEXT, 0);
    let (bytes, _) = image("log(string.length(\"hello\"), \"x\")", FULL);
    assert_ne!(header(&bytes).form() & FORM_TEXT, 0);
    // One more is the library's field name.
    let text = [&[5][..], b"hello", &[6], b"length", &[1], b"x"].concat();
    let at = usize::from(header(&bytes).text_at());
    assert_eq!(bytes[at..at + text.len()], text);
    assert_eq!(usize::from(header(&bytes).code_at()), at + text.len());
}

fn function(bytes: usize) -> FunctionCode {
    let mut code = vec![0, 1];
    code.extend([0x00, 0x02].repeat(bytes / 2));
    code.push(0xbc);
    FunctionCode { bytes: code, ..FunctionCode::default() }
}

#[test]
fn rows_of_the_library_table_are_sorted_and_single() {
    let row = |library, string, builtin| LibraryRow { library, string, builtin };
    let parts = ImageContent {
        libraries: vec![row(6, 13, 65), row(1, 14, 20), row(6, 12, 66), row(6, 13, 65)],
        strings: StringTable::new(["a", "b", "c"]),
        functions: vec![function(2)],
        ..ImageContent::default()
    };
    let image = parts.write().unwrap();
    let at = usize::from(header(&image.bytes).libraries_at());
    assert_eq!(image.bytes[at - 1], 3);
    assert_eq!(image.bytes[at..at + 12], [1, 14, 0, 20, 6, 12, 0, 66, 6, 13, 0, 65]);
    assert_eq!(usize::from(builtin::string::COUNT), 12);
}

#[test]
fn limits_of_an_image() {
    let parts = |functions| ImageContent { functions, ..ImageContent::default() };
    // The bytes of a function are not verified.
    let of_length = |length: usize| {
        let code = FunctionCode { bytes: vec![0; length], ..FunctionCode::default() };
        parts(vec![code]).write().map(|image| image.bytes.len())
    };
    let rest = of_length(0).unwrap();
    assert_eq!(of_length(BYTES_MAX - rest), Ok(BYTES_MAX));
    assert_eq!(of_length(BYTES_MAX - rest + 1), Err(ImageBuildError::Length(BYTES_MAX + 1)));
    let globals = |globals| ImageContent { globals, ..parts(vec![function(2)]) }.write().err();
    assert_eq!(globals(32767), None);
    assert_eq!(globals(32768), Some(ImageBuildError::Count { what: "globals", count: 32768 }));
    let text = |length: usize| {
        let long = "x".repeat(length);
        let strings = StringTable::new([long.as_str()]);
        ImageContent { text: true, strings, ..parts(vec![function(2)]) }.write().err()
    };
    assert_eq!(text(32767), None);
    assert_eq!(text(32768), Some(ImageBuildError::StringLength(32768)));
}

#[test]
fn the_hash_covers_source_and_profile_only() {
    let hash = |script: &str, profile| image(script, profile).1.script_hash;
    assert_eq!(hash("x = 1", TINY), hash("x   =\n1 # comment", TINY));
    assert_ne!(hash("x = 1", TINY), hash("x = 2", TINY));
    assert_ne!(hash("x = 1", TINY), hash("x = 1", FULL));
    let (bytes, symbols) = image("x = 1", FULL);
    assert_eq!(header(&bytes).hash(), symbols.script_hash);
}
