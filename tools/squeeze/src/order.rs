//! Orders functions so that more calls are short.
//!
//! A call takes two bytes if its target is within 4 kB, else four; the linker chooses (`-mrelax`).
//! The linker keeps the order of sections, and each function has a section of its own. The order is
//! found by simulated annealing (Kirkpatrick, Gelatt, Vecchi 1983) with a fixed seed.

use std::collections::HashMap;

use crate::listing::{Listing, ListingLine};

/// The greatest distance of calls that become short. `rcall` reaches 4,096 bytes (AVR instruction
/// set manual, RCALL); the limit is higher because other calls in between become short too, but are
/// counted as long ones here.
const REACH: u32 = 4_400;
/// The number of moves that are tried.
const MOVES: u32 = 2_000_000;
/// The number of additional long calls that a move may cost at the beginning.
const HEAT: f64 = 3.0;

/// The lines of a section, and the calls in it.
#[derive(Default)]
struct AsmSection<'a> {
    lines: Vec<&'a ListingLine>,
    bytes: usize,
    /// The positions of calls in the section, and their targets.
    calls: Vec<(usize, &'a str)>,
}

/// A call. The search looks at each of them two million times, so they take little memory.
struct CallSite {
    /// The sections of the call and of its target.
    from: u16,
    to: u16,
    /// The position of the target in its section minus that of the call, plus [`REACH`], modulo 2^32.
    offset: u32,
}

/// The places of sections by their numbers, of which every one has an element.
type Places = [u32; 1 << 16];

/// Puts the sections of functions in the best order, before everything else.
pub fn order(listing: &Listing) -> Listing {
    let starts_section = |line: &ListingLine| matches!(line, ListingLine::Other(text) if text.trim_start().starts_with(".section"));
    let mut code: Vec<AsmSection<'_>> = Vec::new();
    let mut rest = Vec::new();
    // The number of the section of each name, because a section may continue elsewhere.
    let mut numbers = HashMap::new();
    let mut labels = HashMap::new();
    for lines in listing.lines.chunk_by(|_, next| !starts_section(next)) {
        let ListingLine::Other(first) = &lines[0] else {
            rest.push(lines);
            continue;
        };
        let name = first.split(',').next().unwrap_or_default();
        if !name.contains("\t.text.") {
            rest.push(lines);
            continue;
        }
        let number = *numbers.entry(name).or_insert(code.len());
        if number == code.len() {
            code.push(AsmSection::default());
        }
        code[number].read(lines, number, &mut labels);
    }
    let mut calls = Vec::new();
    for (number, section) in code.iter().enumerate() {
        for (at, symbol) in &section.calls {
            if let Some((to, label)) = labels.get(symbol) {
                let offset = (*label as u32).wrapping_sub(*at as u32).wrapping_add(REACH);
                calls.push(CallSite { from: number as u16, to: *to as u16, offset });
            }
        }
    }
    // The lines before the first section name the file.
    let (first, rest) = rest.split_at(rest.len().min(1));
    let order = anneal(&code, &calls);
    let ordered = order.iter().flat_map(|number| code[*number].lines.iter().copied());
    let all = first.iter().copied().flatten().chain(ordered).chain(rest.iter().copied().flatten());
    Listing { lines: all.cloned().collect() }
}

impl<'a> AsmSection<'a> {
    /// Adds these lines to the section, which has that number.
    fn read(
        &mut self,
        lines: &'a [ListingLine],
        number: usize,
        labels: &mut HashMap<&'a str, (usize, usize)>,
    ) {
        for line in lines {
            match line {
                ListingLine::Label(label) => {
                    labels.insert(label, (number, self.bytes));
                }
                ListingLine::Code(code) => {
                    if matches!(code.name.as_str(), "call" | "jmp") {
                        self.calls.push((self.bytes, &code.operands));
                    }
                    self.bytes += code.bytes();
                }
                ListingLine::Other(_) => {}
            }
            self.lines.push(line);
        }
    }
}

/// Returns the numbers of the sections in the order with the fewest long calls.
fn anneal(sections: &[AsmSection<'_>], calls: &[CallSite]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sections.len()).collect();
    let bytes: Vec<u32> = sections.iter().map(|section| section.bytes as u32).collect();
    let mut places: Box<Places> = Box::new([0; 1 << 16]);
    let mut now = long_calls(&bytes, calls, &order, &mut places);
    let (mut best, mut fewest) = (order.clone(), now);
    let mut random = Xorshift32(1);
    for tried in 0..MOVES {
        if fewest == 0 {
            break;
        }
        let (from, to) = (random.below(order.len()), random.below(order.len()));
        let moved = order.remove(from);
        order.insert(to, moved);
        let then = long_calls(&bytes, calls, &order, &mut places);
        // The temperature falls fast, then slowly: three images of the Kilobot have 7 % fewer long
        // calls than with linear cooling.
        let heat = HEAT * (f64::from(MOVES - tried) / f64::from(MOVES)).powi(3);
        let more = then as f64 - now as f64;
        if more <= 0.0 || random.unit() < (-more / heat).exp() {
            now = then;
            if now < fewest {
                fewest = now;
                best.clone_from(&order);
            }
        } else {
            let moved = order.remove(to);
            order.insert(from, moved);
        }
    }
    best
}

fn long_calls(bytes: &[u32], calls: &[CallSite], order: &[usize], places: &mut Places) -> usize {
    let mut at = 0;
    for number in order {
        places[*number] = at;
        at += bytes[*number];
    }
    let is_long = |call: &&CallSite| {
        let [from, to] = [call.from, call.to].map(|section| places[usize::from(section)]);
        // A distance between -REACH and REACH is between 0 and twice that.
        to.wrapping_sub(from).wrapping_add(call.offset) > 2 * REACH
    };
    calls.iter().filter(is_long).count()
}

/// A generator of pseudo-random numbers (xorshift32, Marsaglia 2003).
struct Xorshift32(u32);

impl Xorshift32 {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    fn below(&mut self, limit: usize) -> usize {
        self.next() as usize % limit
    }

    fn unit(&mut self) -> f64 {
        f64::from(self.next()) / f64::from(u32::MAX)
    }
}
