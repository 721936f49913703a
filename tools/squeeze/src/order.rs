//! Functions in an order in which more calls are short.
//!
//! A call takes two bytes if its target is within 4 kB, else four; the linker chooses (`-mrelax`). It keeps the order of sections,
//! of which each function has one. The order is found by simulated annealing (Kirkpatrick, Gelatt, Vecchi 1983), always the same.

use std::collections::HashMap;

use crate::listing::{Line, Listing};

/// How far calls are that become short: `rcall` reaches 4,096 bytes (AVR instruction set manual, RCALL), and between it and its
/// target are others that become short, which are measured as long ones here.
const REACH: usize = 4_400;
/// The number of moves that are tried.
const MOVES: u32 = 2_000_000;
/// The number of additional long calls that a move may cost in the beginning.
const HEAT: f64 = 3.0;

/// The lines of a section, and the calls in it.
#[derive(Default)]
struct AsmSection<'a> {
    lines: Vec<&'a Line>,
    bytes: usize,
    /// The places of calls, and their targets.
    calls: Vec<(usize, &'a str)>,
}

/// A call: the section and the place in it from which it leads, and to which.
struct Call {
    from: (usize, usize),
    to: (usize, usize),
}

/// Puts the sections of functions in order, before everything else.
pub fn order(listing: &Listing) -> Listing {
    let starts_section = |line: &Line| matches!(line, Line::Other(text) if text.trim_start().starts_with(".section"));
    let mut code: Vec<AsmSection<'_>> = Vec::new();
    let mut rest = Vec::new();
    // The number of the section of each name: it may go on elsewhere.
    let mut numbers = HashMap::new();
    let mut labels = HashMap::new();
    for lines in listing.lines.chunk_by(|_, next| !starts_section(next)) {
        let Line::Other(first) = &lines[0] else {
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
            if let Some(to) = labels.get(symbol) {
                calls.push(Call { from: (number, *at), to: *to });
            }
        }
    }
    // What stands before the first section names the file.
    let (first, rest) = rest.split_at(rest.len().min(1));
    let order = anneal(&code, &calls);
    let ordered = order.iter().flat_map(|number| code[*number].lines.iter().copied());
    let all = first.iter().copied().flatten().chain(ordered).chain(rest.iter().copied().flatten());
    Listing { lines: all.cloned().collect() }
}

impl<'a> AsmSection<'a> {
    /// Takes these lines to the section of that number.
    fn read(
        &mut self,
        lines: &'a [Line],
        number: usize,
        labels: &mut HashMap<&'a str, (usize, usize)>,
    ) {
        for line in lines {
            match line {
                Line::Label(label) => {
                    labels.insert(label, (number, self.bytes));
                }
                Line::Code(code) => {
                    if matches!(code.name.as_str(), "call" | "jmp") {
                        self.calls.push((self.bytes, &code.operands));
                    }
                    self.bytes += code.bytes();
                }
                Line::Other(_) => {}
            }
            self.lines.push(line);
        }
    }
}

/// The numbers of the sections in the order in which the fewest calls are long.
fn anneal(sections: &[AsmSection<'_>], calls: &[Call]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sections.len()).collect();
    let mut places = vec![0; sections.len()];
    let mut now = long_calls(sections, calls, &order, &mut places);
    let (mut best, mut fewest) = (order.clone(), now);
    let mut random = Random(1);
    for tried in 0..MOVES {
        if fewest == 0 {
            break;
        }
        let (from, to) = (random.below(order.len()), random.below(order.len()));
        let moved = order.remove(from);
        order.insert(to, moved);
        let then = long_calls(sections, calls, &order, &mut places);
        // It cools fast, then slowly: three images of the Kilobot have 7 % fewer long calls than with a steady pace.
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

fn long_calls(
    sections: &[AsmSection<'_>],
    calls: &[Call],
    order: &[usize],
    places: &mut [usize],
) -> usize {
    let mut at = 0;
    for number in order {
        places[*number] = at;
        at += sections[*number].bytes;
    }
    calls
        .iter()
        .filter(|call| {
            let from = places[call.from.0] + call.from.1;
            from.abs_diff(places[call.to.0] + call.to.1) > REACH
        })
        .count()
}

/// Numbers as if by chance (xorshift32, Marsaglia 2003).
struct Random(u32);

impl Random {
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
