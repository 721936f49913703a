//! Random scripts that pass values of all classes through variables, functions, tables, listeners and stigmergies: robots
//! with one script never drop a value that one of them has sent.

use std::fmt::Write;

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_testkit::{Answer, Random, Recorder, SIZES, Swarm, TestRobot};
use bittybuzz_tests::{compiler, files, report};
use bittybuzz_vm_core::image::Image;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// Steps of each script.
const STEPS: usize = 300;

/// A writer of scripts. A robot function, `light()`, decides which of its statements a function carries out, so that a
/// fault of one does not keep the others from running.
struct Script {
    random: Random,
    text: String,
    /// Names of the function's own variables.
    locals: Vec<&'static str>,
    is_full: bool,
    /// `self` is not always nil.
    has_self: bool,
    /// The class of most values.
    preferred: u64,
}

const GLOBALS: &[&str] = &["g0", "g1", "g2", "g3", "g4", "g5"];
const TOPICS: &[&str] = &["\"a\"", "\"b\"", "\"c\"", "\"d\""];
const KEYS: &[&str] = &["\"a\"", "\"k\"", "\"l\"", "1"];
const FUNCTIONS: &[&str] = &["f0", "f1", "f2"];

impl Script {
    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.random.below(of.len() as u64) as usize]
    }

    fn percent(&mut self, percent: u64) -> bool {
        self.random.below(100) < percent
    }

    /// Returns the script of a seed.
    fn with_seed(seed: u64, is_full: bool) -> String {
        let mut random = Random::new(seed);
        let preferred = random.below(5);
        let (text, locals, has_self) = (String::new(), vec![], false);
        let mut script = Script { random, text, locals, is_full, has_self, preferred };
        script.write();
        script.text
    }

    fn write(&mut self) {
        for global in GLOBALS {
            if self.percent(70) {
                let value = self.constant();
                let _ = writeln!(self.text, "{global} = {value}");
            }
        }
        self.text.push_str("s = stigmergy.create(1)\nt = {.x = 1}\n");
        for name in FUNCTIONS {
            self.function(&format!("function {name}(p, q)"), vec!["p", "q"], 3);
        }
        // Each is assigned somewhere.
        for global in GLOBALS {
            let value = self.constant();
            let _ = writeln!(self.text, "function assign_{global}() {{ {global} = {value} }}");
        }
        self.function("function init()", vec![], 6);
        self.function("function step()", vec![], 14);
    }

    fn function(&mut self, head: &str, parameters: Vec<&'static str>, statements: usize) {
        let outer = std::mem::replace(&mut self.locals, parameters);
        let _ = writeln!(self.text, "{head} {{");
        self.statements(statements, 2);
        if self.percent(70) {
            let value = self.value(2);
            let _ = writeln!(self.text, "return {value}");
        }
        self.text.push_str("}\n");
        self.locals = outer;
    }

    fn statements(&mut self, count: usize, depth: usize) {
        let known = self.locals.len();
        for _ in 0..count {
            let statement = self.statement(depth);
            let sides = 2 + self.random.below(4);
            let _ = match statement.starts_with("var ") {
                // The variable is for the statements after it, too.
                true => writeln!(self.text, "{statement}"),
                false => writeln!(self.text, "if(light() % {sides} == 0) {{ {statement} }}"),
            };
        }
        self.locals.truncate(known);
    }

    fn statement(&mut self, depth: usize) -> String {
        let value = self.value(depth);
        match self.random.below(18) {
            0..=3 => format!("neighbors.broadcast({}, {value})", self.topic()),
            4..=5 => format!("s.put({}, {value})", self.key()),
            6..=7 => format!("{} = {value}", self.variable()),
            8 => {
                let local = self.pick(&["u", "v", "w"]);
                if self.locals.contains(&local) {
                    return format!("{local} = {value}");
                }
                self.locals.push(local);
                format!("var {local} = {value}")
            }
            9 | 10 => {
                let value = match self.percent(50) {
                    true => self.method(depth),
                    false => value,
                };
                match self.percent(50) {
                    true => format!("{}.{} = {value}", self.table(), self.field()),
                    false => format!("{}[{}] = {value}", self.table(), self.index()),
                }
            }
            11..=12 => {
                let listener = self.callback(3, depth);
                format!("neighbors.listen({}, {listener})", self.topic())
            }
            13 => format!("s.onconflict({})", self.handler(depth)),
            14 => format!("s.onconflictlost({})", self.callback(2, depth)),
            15 => {
                let object = self.pick(&["s", "t"]);
                let at = self.pick(&[".f", "[1]"]);
                match self.percent(50) {
                    true => format!("{object}{at} = {}", self.method(depth)),
                    false => format!("{object}{at}({value})"),
                }
            }
            16 if self.has_self => format!("self.put({}, {value})", self.key()),
            _ => {
                let call = self.call(depth);
                format!("{} = {call}", self.variable())
            }
        }
    }

    fn variable(&mut self) -> &'static str {
        match self.locals.is_empty() || self.percent(50) {
            true => self.pick(GLOBALS),
            false => {
                let locals = self.locals.clone();
                self.pick(&locals)
            }
        }
    }

    fn table(&mut self) -> String {
        match self.random.below(4) {
            0 => self.variable().to_owned(),
            1 if self.has_self => "self".to_owned(),
            2 if self.percent(10) => "s".to_owned(),
            _ => "t".to_owned(),
        }
    }

    fn index(&mut self) -> String {
        match self.percent(70) {
            true => self.pick(&["1", "2", "\"x\"", "id"]).to_owned(),
            false => self.variable().to_owned(),
        }
    }

    /// A function for a table.
    fn method(&mut self, depth: usize) -> String {
        let had_self = std::mem::replace(&mut self.has_self, true);
        let function = self.callback(2, depth.max(1));
        self.has_self = had_self;
        function
    }

    fn field(&mut self) -> &'static str {
        self.pick(&["x", "y", "z", "robot", "data", "f"])
    }

    fn topic(&mut self) -> String {
        match self.percent(92) {
            true => self.pick(TOPICS).to_owned(),
            false => self.variable().to_owned(),
        }
    }

    fn key(&mut self) -> String {
        match self.percent(92) {
            true => self.pick(KEYS).to_owned(),
            false => self.variable().to_owned(),
        }
    }

    /// A value, mostly of the class that the script prefers: the fewer classes a script sends, the more are refused.
    fn constant(&mut self) -> String {
        let class = match self.percent(93) {
            true => self.preferred,
            false => self.random.below(5),
        };
        match class {
            0 => "nil".to_owned(),
            1 => self.pick(&["id", "3", "2.5", "-1"]).to_owned(),
            2 => self.pick(TOPICS).to_owned(),
            3 => self.pick(FUNCTIONS).to_owned(),
            _ => "{}".to_owned(),
        }
    }

    fn value(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.percent(50) {
                true => self.constant(),
                false => self.variable().to_owned(),
            };
        }
        let a = self.value(depth - 1);
        match self.random.below(20) {
            0..=3 => self.variable().to_owned(),
            4 => format!("{}.{}", self.table(), self.field()),
            5 => format!("{}[{}]", self.table(), self.index()),
            6 => format!("{{.{} = {a}, .1 = {}}}", self.field(), self.value(0)),
            7 => format!("s.get({})", self.key()),
            8 => format!("math.{}({a}, {})", self.pick(&["min", "max"]), self.value(0)),
            9 => format!("clone({a})"),
            10 => format!("({a}) + 1"),
            11 => format!("type({a})"),
            12 if self.is_full => format!("string.{}", self.made()),
            13..=17 => self.call(depth),
            _ => self.constant(),
        }
    }

    fn made(&mut self) -> String {
        let topic = self.pick(TOPICS);
        match self.random.below(3) {
            0 => format!("concat({topic}, \"\")"),
            1 => format!("toint({topic})"),
            _ => format!("tostring({})", self.value(0)),
        }
    }

    fn call(&mut self, depth: usize) -> String {
        let depth = depth.saturating_sub(1);
        let (a, b) = (self.value(0), self.value(0));
        match self.random.below(16) {
            0..=2 => format!("{}({a}, {b})", self.pick(FUNCTIONS)),
            3 => format!("{}({a})", self.variable()),
            4 => format!("{}.{}({a})", self.table(), self.field()),
            5 => format!("{}[{}]({b})", self.table(), self.index()),
            6 => format!("map({}, {})", self.table(), self.callback(2, depth)),
            7 => format!("filter({}, {})", self.table(), self.callback(2, depth)),
            8 => format!("reduce({}, {}, {a})", self.table(), self.callback(3, depth)),
            9 => format!("s.map({})", self.callback(3, depth)),
            10 => format!("s.reduce({}, {a})", self.callback(4, depth)),
            11 => format!("neighbors.reduce({}, {a})", self.callback(3, depth)),
            12 => format!("neighbors.map({}).get({a})", self.callback(2, depth)),
            13 => format!("neighbors.get({a})"),
            14 => format!("led({a})"),
            _ => format!("f0({}, {b})", self.callback(2, depth)),
        }
    }

    /// A function with that number of parameters, or a variable that may hold one.
    fn callback(&mut self, parameters: usize, depth: usize) -> String {
        if depth == 0 || self.percent(20) {
            return match self.percent(60) {
                true => self.pick(FUNCTIONS).to_owned(),
                false => self.variable().to_owned(),
            };
        }
        let all = ["x1", "x2", "x3", "x4"];
        let names = &all[..parameters];
        self.locals.retain(|name| !all.contains(name));
        let kept = self.locals.clone();
        self.locals.extend(names);
        let mut body = String::new();
        for _ in 0..self.random.below(3) {
            let statement = self.statement(depth - 1);
            let _ = match statement.starts_with("var ") {
                true => write!(body, "{statement} "),
                false => write!(body, "if(light() % 3 != 0) {{ {statement} }} "),
            };
        }
        let result = self.value(depth - 1);
        self.locals = kept;
        format!("function({}) {{ {body}return {result} }}", names.join(", "))
    }

    fn handler(&mut self, depth: usize) -> String {
        let result = match self.random.below(5) {
            0 => "{.robot = l.robot, .data = g0}".to_owned(),
            1 => "{.robot = r.robot}".to_owned(),
            2 => "clone(l)".to_owned(),
            3 => return self.callback(3, depth),
            _ => "l".to_owned(),
        };
        let change = match self.random.below(4) {
            0 => format!("l.data = {}", self.value(0)),
            1 => format!("l[{}] = {}", self.value(0), self.value(0)),
            2 => format!("{} = r.data", self.pick(GLOBALS)),
            _ => String::new(),
        };
        format!("function(k, l, r) {{ {change} return {result} }}")
    }
}

/// Runs a script on three robots. Returns the number of frames, 0 if the script has no class table.
fn play<P: Profile>(seed: u64) -> Result<usize, String> {
    let script = Script::with_seed(seed, P::FULL);
    let compiled = compiler::compile(script.clone(), P::FULL, &MemoryFiles::default());
    // The checks find some mistakes in it.
    let Some(image) = compiled.image else { return Ok(0) };
    let header = Image::new(image.as_slice()).header().map_err(|error| format!("{error:?}"))?;
    let has_table = header.classes_at().is_some();
    let image: &'static [u8] = Vec::leak(image);
    let robots = (1..=3).map(|id| {
        let mut robot: TestRobot<P, &'static [u8], 3000> = TestRobot::new(image, id, SIZES);
        let mut random = Random::new(seed + u64::from(id));
        robot.host = Recorder::answering(move |call| match call.arguments.len() {
            0 => Answer::Int(random.below(1000) as i32),
            _ if random.below(3) == 0 => Answer::Nil,
            _ => Answer::First,
        });
        robot
    });
    let mut swarm = Swarm::of(robots.collect());
    let mut frames = 0;
    for step in 0..STEPS {
        frames += swarm.try_step();
        for robot in &mut swarm.robots {
            robot.host.events.clear();
            if robot.fault.is_some() {
                robot.rest();
                let _ = robot.start();
            }
            let counters = robot.counters();
            if counters.malformed != 0 {
                return Err(format!(
                    "seed {seed}, {}, step {step}, robot {}: {counters:?}\n{script}",
                    P::NAME,
                    robot.id
                ));
            }
        }
    }
    Ok(if has_table { frames } else { 0 })
}

#[test]
fn robots_with_one_script_accept_all_messages_of_each_other() {
    let runs: Vec<(u64, bool)> = (0..200).flat_map(|seed| [(seed, false), (seed, true)]).collect();
    let results =
        files::in_parallel(
            &runs,
            |(seed, full)| {
                if *full { play::<Full>(*seed) } else { play::<Tiny>(*seed) }
            },
        );
    let frames: usize = results.iter().flatten().sum();
    let with_table = results.iter().flatten().filter(|frames| **frames > 0).count();
    println!("{with_table} of {} scripts have a table, {frames} frames", runs.len());
    assert!(with_table >= 80 && frames > 100_000, "{with_table} scripts, {frames} frames");
    let failures: Vec<String> = results.into_iter().filter_map(Result::err).collect();
    report::conclude("scripts that exchange values", runs.len(), 100, &failures);
}
