//! The known scripts that mutations start from.

use std::sync::OnceLock;

use bittybuzz_robots::Profile;
use bittybuzz_tests::generator::{Options, program};

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

/// Words that turn up in scripts, for those that do not have them.
#[rustfmt::skip]
pub const WORDS: &[&str] = &[
    "(", ")", "{", "}", "[", "]", ",", ".", "=", "==", "!=", "<", "+", "-", "*", "/", "%", "^", "&", "|", "!",
    "<<", ">>", " and ", " or ", " not ", " nil ", " self ", "\nvar ", "\nif(", " else ", "\nwhile(",
    "\nfor(", "\nfunction ", " function(", "\nreturn ", "\n", ";", "#", "\"", "'", "0", "1", "-1", "40000",
    "0.5", "1e9", "x", "t", "math", "foreach", "log", "swarm", "include ", "\"vec2.bzz\"",
];

/// A script as words with the blanks between them.
pub fn words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let end = if is_name(first) {
            rest.find(|c| !is_name(c)).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (word, after) = rest.split_at(end);
        words.push(word);
        rest = after;
    }
    words
}

/// How many random programs stand beside the scripts.
const PROGRAMS: u64 = 8;

/// The images of the scripts and of random programs, in both profiles.
pub fn images() -> &'static [Vec<u8>] {
    static IMAGES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    IMAGES.get_or_init(|| {
        let profiles = [Profile::Tiny, Profile::Full];
        let compiled = profiles.iter().flat_map(|profile| {
            let full = *profile == Profile::Full;
            let programs = (0..PROGRAMS)
                .map(move |seed| program(Options { seed, full, hide_literals: false }));
            let scripts = SCRIPTS.iter().map(|text| (*text).to_owned());
            scripts.chain(programs).filter_map(|text| compile_text(&text, *profile).image)
        });
        compiled.collect()
    })
}
