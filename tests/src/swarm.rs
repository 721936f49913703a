//! Several robots in this process, each with a virtual machine, and a medium that does what a test asks of it.

use std::collections::VecDeque;

use bittybuzz_vm_core::builtin::{self, string};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Calls, Counters, Entry, Fault, Host, Image, Item, Outcome, Periods,
    Reply, RobotFault, Sighting, Sizes, Value, Vm,
};

use crate::compiler;
use bittybuzz_compiler::include::MemoryFiles;

/// What the Kilobot has.
const SLOTS: usize = 350;
const SIZES: Sizes = Sizes { neighbors: 15, bearings: true, entries: 4, swarms: 8 };
type Machine<P> = Vm<P, &'static [u8], { SLOTS + SIZES.slots() }>;

/// Robots that run one script, number 0 with id 1 and so on.
pub struct Swarm<P: Profile> {
    /// Who is in it.
    pub robots: Vec<Robot<P>>,
    /// Whether a frame from one robot, by its place, reaches another: asked once for each frame, it may be lost.
    pub reaches: Box<dyn FnMut(usize, usize) -> bool>,
    /// How often a frame arrives that reaches a robot.
    pub copies: usize,
}

/// A robot.
pub struct Robot<P: Profile> {
    vm: Box<Machine<P>>,
    /// What it meets.
    pub link: Link,
    id: u16,
    has_begun: bool,
}

/// What a robot meets: frames in and out, and what it prints.
#[derive(Default)]
pub struct Link {
    /// Frames that wait, with the place of their sender.
    pub inbox: VecDeque<(Vec<u8>, usize)>,
    /// Frames sent in this step.
    pub outbox: Vec<Vec<u8>>,
    /// Lines printed.
    pub log: Vec<String>,
    /// Faults that ended a listener or a handler of conflicts.
    pub contained: Vec<Fault>,
    /// Where the robot is in the row of robots.
    place: usize,
    strings: Vec<String>,
}

impl<P: Profile> Swarm<P> {
    /// So many robots with the script, in a row, 10 mm from one to the next; all hear all.
    pub fn new(count: usize, script: &str) -> Self {
        let compiled = compiler::compile(script.to_owned(), P::FULL, &MemoryFiles::default());
        let (Some(image), Some(symbols)) = (compiled.image, compiled.symbols) else {
            panic!("{script}: {:?}", compiled.diagnostics);
        };
        let image: &'static [u8] = Vec::leak(image);
        let strings = symbols.strings;
        let robots = (0..count).map(|place| {
            let mut vm: Box<Machine<P>> = Box::new(Vm::new());
            vm.equip(SIZES);
            if let Err(error) = vm.load(Image::new(image), |_| true) {
                panic!("{script}: {error:?}");
            }
            let id = place as u16 + 1;
            vm.identify(id, 1);
            let link = Link { place, strings: strings.clone(), ..Link::default() };
            Robot { vm, link, id, has_begun: false }
        });
        Swarm { robots: robots.collect(), reaches: Box::new(|_, _| true), copies: 1 }
    }

    /// One step of every robot, in order, the first time after global code and `init()`; then all frames are delivered.
    pub fn step(&mut self) {
        for robot in &mut self.robots {
            if let Err(fault) = robot.try_step() {
                panic!("robot {}: {fault:?}, after {:?}", robot.id, robot.link.log);
            }
        }
        self.deliver();
    }

    /// So many steps.
    pub fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.step();
        }
    }

    fn deliver(&mut self) {
        for from in 0..self.robots.len() {
            for frame in std::mem::take(&mut self.robots[from].link.outbox) {
                for to in 0..self.robots.len() {
                    if to != from && (self.reaches)(from, to) {
                        let inbox = &mut self.robots[to].link.inbox;
                        inbox.extend(std::iter::repeat_n((frame.clone(), from), self.copies));
                    }
                }
            }
        }
    }

    /// What every robot printed, robot by robot.
    pub fn logs(&self) -> Vec<Vec<&str>> {
        self.robots
            .iter()
            .map(|robot| robot.link.log.iter().map(String::as_str).collect())
            .collect()
    }

    /// What every robot printed last.
    pub fn last(&self) -> Vec<&str> {
        self.robots.iter().map(|robot| robot.link.log.last().map_or("", String::as_str)).collect()
    }
}

impl<P: Profile> Robot<P> {
    /// One step, the first time after global code and `init()`.
    pub fn try_step(&mut self) -> Result<(), Fault> {
        if !self.has_begun {
            self.has_begun = true;
            self.run(Entry::Global)?;
            self.run(Entry::Init)?;
        }
        self.run(Entry::Step)
    }

    /// Makes the script ready to start again. Until [`Robot::start`] its steps handle messages only.
    pub fn restart(&mut self) {
        self.vm.restart();
    }

    /// Runs the global code and `init()` again.
    pub fn start(&mut self) -> Result<(), Fault> {
        self.run(Entry::Global)?;
        self.run(Entry::Init)
    }

    fn run(&mut self, entry: Entry) -> Result<(), Fault> {
        if !self.vm.begin(entry) {
            return Ok(());
        }
        for _ in 0..1_000_000 {
            // A few instructions at a time, so that everything is interrupted everywhere.
            match self.vm.run(&mut self.link, 3) {
                Outcome::Done => return Ok(()),
                Outcome::Fault(fault) => return Err(fault),
                Outcome::Pending | Outcome::Waiting => {}
            }
            if let Err(problem) = self.vm.audit() {
                panic!("robot {}: {problem}", self.id);
            }
        }
        panic!("robot {}: {entry:?} does not end", self.id);
    }

    /// What it could not use.
    pub fn counters(&mut self) -> Counters {
        self.vm.counters()
    }
}

impl<P: Profile> Host<P> for Link {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _: u16,
        _: Arguments<'_, P, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<P>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        let items = (0..arguments.count()).map(|index| match arguments.item(index) {
            Item::Nil => "nil".to_owned(),
            Item::Int(value) => value.to_string(),
            Item::Float(value) => format!("{value:.1}"),
            Item::String(text) => match text.number() {
                Some(number) => match number.checked_sub(string::COUNT) {
                    Some(own) => self.strings.get(usize::from(own)).cloned().unwrap_or_default(),
                    None => builtin::STRINGS[usize::from(number)].to_owned(),
                },
                None => String::from_utf8_lossy(&text.bytes().collect::<Vec<_>>()).into_owned(),
            },
            Item::Table(size) => format!("[{size}]"),
            Item::Function => "function".to_owned(),
        });
        let line = items.collect::<Vec<_>>().concat();
        self.log.push(line);
    }

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn periods(&self) -> Periods {
        Periods { beacon: 5, forget: 10, advertise: 10 }
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        let (bytes, from) = self.inbox.pop_front()?;
        let length = bytes.len().min(frame.len());
        frame[..length].copy_from_slice(&bytes[..length]);
        let distance = 10.0 * self.place.abs_diff(from) as f32;
        let azimuth = if from > self.place { 0.0 } else { std::f32::consts::PI };
        let place = [distance, azimuth, 0.0].map(Value::float);
        sighting.place = Some(place);
        Some(length)
    }

    fn send(&mut self, frame: &[u8]) {
        self.outbox.push(frame.to_vec());
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        _: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        self.contained.push(*fault);
        true
    }
}
