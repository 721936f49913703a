//! The known scripts that mutations start from.

use std::sync::OnceLock;

use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_tests::generator::{Options, program};

use crate::bo_mutation::Program;
use crate::compile_text;

/// Scripts that together use every part of the language.
pub const SCRIPTS: &[&str] = &[
    include_str!("../../../examples/blink.bzz"),
    include_str!("../../../examples/breathing.bzz"),
    include_str!("../../../examples/dice.bzz"),
    include_str!("../../../examples/morse.bzz"),
    include_str!("../../../examples/patrol.bzz"),
    include_str!("../../../examples/traffic_light.bzz"),
    include_str!("../../../lib/matrix.bzz"),
    include_str!("../../../lib/table.bzz"),
    include_str!("../../../lib/vec2.bzz"),
    EVERYTHING,
];

/// What the others do not use.
const EVERYTHING: &str = r#"
t = { .a = 1, .2 = "two", .f = function(x) { return self.a + x } }
function init() {
  var g = t.f
  var i = 0
  for(k = 0, k < 3 and not (k == 7) or i > 9, k = k + 1) { t[k] = k % 2 ^ 2 }
  while(i < 5) { i = i + 1 if(i & 1 | 2 << 1) t[i * 1.5] = -i else t["s"] = !i }
  foreach(t, function(key, value) { if(isint(value)) t[key] = nil })
  log(g(2), reduce(filter(map(t, function(k, v) { return v }), math.abs), math.max, 0))
  math.half = function(x) { return x / 2 }
  var m = math
  log(m.half(7), size(m), clone(t), type(m), t.f(1), id, rand())
  delay(5)
}
function deep(n) { if(n <= 0) return 0 return 1 + deep(n - 1) }
function step() {
  var k = deep(5)
  var later = function() { return k + deep(2) }
  led(later()) assert(k, "no k")
  if(set_motor) set_motor(k, k) else forward()
  log(math.sqrt(2.0), math.rng.uniform(1, 6), pos.x, k >> 1, k != 3, nil < k)
}
function reset() { t = {} }
"#;

/// About how long a piece of a script is that is changed: the shorter, the more of them are tried.
const PIECE: usize = 400;

/// The scripts without comments, in pieces of some whole functions or statements.
pub fn pieces() -> &'static [String] {
    static PIECES: OnceLock<Vec<String>> = OnceLock::new();
    PIECES.get_or_init(|| SCRIPTS.iter().flat_map(|text| split(text)).collect())
}

fn split(text: &str) -> Vec<String> {
    let mut pieces = vec![String::new()];
    for line in text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()) {
        let starts = !line.starts_with([' ', '}']);
        if starts && pieces.last().is_none_or(|piece| piece.len() > PIECE) {
            pieces.push(String::new());
        }
        if let Some(piece) = pieces.last_mut() {
            piece.push_str(line);
            piece.push('\n');
        }
    }
    pieces
}

/// The number of random programs in addition to the scripts.
const PROGRAMS: u64 = 8;

/// The images of the scripts and of random programs, in both profiles.
pub fn images() -> &'static [Vec<u8>] {
    static IMAGES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    IMAGES.get_or_init(|| {
        let profiles = [NumberProfile::Tiny, NumberProfile::Full];
        let compiled = profiles.iter().flat_map(|profile| {
            let full = *profile == NumberProfile::Full;
            let programs = (0..PROGRAMS)
                .map(move |seed| program(Options { seed, full, hide_literals: false }));
            let scripts = SCRIPTS.iter().map(|text| (*text).to_owned());
            scripts.chain(programs).filter_map(|text| compile_text(&text, *profile).image)
        });
        compiled.collect()
    })
}

/// Images of two scripts, a short one and one with everything, and their symbols as text.
pub fn symbols() -> Vec<(Vec<u8>, String)> {
    let compiled = [SCRIPTS[0], EVERYTHING].map(|text| compile_text(text, NumberProfile::Tiny));
    compiled
        .into_iter()
        .filter_map(|known| Some((known.image?, known.symbols?.to_json())))
        .collect()
}

/// Object files as the reference compiler writes them: of all constructs, of examples, of a library.
const OBJECTS: [&[u8]; 4] = [
    include_bytes!("../seeds/rich.bo"),
    include_bytes!("../seeds/patrol.bo"),
    include_bytes!("../seeds/morse.bo"),
    include_bytes!("../seeds/vec2.bo"),
];

/// Those object files, taken apart.
pub fn objects() -> &'static [Program] {
    static PROGRAMS: OnceLock<Vec<Program>> = OnceLock::new();
    PROGRAMS.get_or_init(|| OBJECTS.iter().filter_map(|bytes| Program::of(bytes)).collect())
}
