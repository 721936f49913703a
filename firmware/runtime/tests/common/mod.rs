//! A robot without hardware, and a clock that the tests control.

use std::future::Future;
use std::path::Path;
use std::pin::pin;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use bittybuzz_comms::trace::{PrintedValue, Record};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_runtime::liveness::Liveness;
use bittybuzz_runtime::script::{Console, Counts, RobotHost, ScriptStopped, ScriptTask};
use bittybuzz_runtime::setpoint::{Channel, MotorDriver, SetpointWriter};
use bittybuzz_runtime::tasks;
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::message::Topics;
use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Image, Reply, RobotFault, Sighting, Sizes, Value, Vm,
};
use embassy_time::{Duration, Instant, MockDriver};

/// Locks and resets the clock, which all tests share.
pub fn clock() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    MockDriver::get().reset();
    turn
}

pub fn advance_us(us: u64) {
    MockDriver::get().advance(Duration::from_micros(us));
}

pub fn now_ms() -> u64 {
    Instant::now().as_millis()
}

/// The recorded events with their times in ms.
pub type Events = Vec<(u64, String)>;

static EVENTS: Mutex<Events> = Mutex::new(Vec::new());

pub fn note(text: impl Into<String>) {
    EVENTS.lock().unwrap().push((now_ms(), text.into()));
}

pub fn take_events() -> Events {
    std::mem::take(&mut EVENTS.lock().unwrap())
}

/// The frames that a robot will receive: time in ms, bytes, and sighting of the sender.
pub type Frames = Vec<(u64, Vec<u8>, Sighting<Full>)>;

/// A fake robot that records the calls.
pub struct Fake<const ON_FAULT_STOPS: bool> {
    pub setpoint: SetpointWriter<i32>,
    pub radio: Frames,
}

const MOTOR: u16 = name_hash("motor");
const WORK: u16 = name_hash("work");

pub fn is_function(hash: u16) -> bool {
    [MOTOR, WORK].contains(&hash)
}

impl<const ON_FAULT_STOPS: bool> RobotHost<Full> for Fake<ON_FAULT_STOPS> {
    const ON_FAULT_STOPS: bool = ON_FAULT_STOPS;

    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, Full, C, SLOTS>,
        _again: bool,
        _console: &mut Console<'_>,
    ) -> Result<Reply<Full>, RobotFault> {
        let argument = arguments.value(0).as_int().unwrap_or(0);
        match function {
            MOTOR => self.setpoint.set(argument),
            // `work(us)` stands for an instruction that takes this time.
            _ => advance_us(u64::try_from(argument).unwrap()),
        }
        Ok(Reply::Value(Value::nil()))
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn begin_step(&mut self, _: Topics) {
        note("begin step");
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<Full>) -> Option<usize> {
        let next = self.radio.iter().position(|(ms, ..)| *ms <= now_ms())?;
        let (_, heard, from) = self.radio.remove(next);
        frame[..heard.len()].copy_from_slice(&heard);
        *sighting = from;
        Some(heard.len())
    }

    fn send(&mut self, frame: &[u8]) {
        note(format!("send {frame:?}"));
    }

    fn report(&mut self, record: &[u8]) {
        note(match Record::decode(record) {
            Ok(Record::Start { .. }) => "start".to_owned(),
            Ok(Record::Log { step, items }) => {
                let items: Vec<String> = items.map(|item| item_text(item.unwrap())).collect();
                format!("log {step}: {}", items.join(" "))
            }
            Ok(Record::Fault { step, fault, calls }) => {
                format!("fault {step}: {:?} in {} calls", fault.code, calls.count())
            }
            Ok(Record::Contained { step, fault, calls }) => {
                format!("contained {step}: {:?} in {} calls", fault.code, calls.count())
            }
            Ok(Record::Restart { step, pause }) => format!("restart {step}: {pause}"),
            Ok(other) => format!("{other:?}"),
            Err(error) => panic!("{error:?}: {record:?}"),
        });
    }

    fn renew(&mut self, _: Counts) {
        self.setpoint.renew();
    }

    fn expire(&mut self) -> bool {
        self.setpoint.expire()
    }

    fn stop(&mut self, reason: ScriptStopped) {
        self.setpoint.stop();
        note(format!("stop {reason:?}"));
    }

    fn restart(&mut self) {
        note("start again");
    }
}

fn item_text(item: PrintedValue<'_>) -> String {
    match item {
        PrintedValue::Int(value) => value.to_string(),
        PrintedValue::Text(text) => String::from_utf8(text.to_vec()).unwrap(),
        other => format!("{other:?}"),
    }
}

pub struct FakeMotors;

impl MotorDriver for FakeMotors {
    type Setpoint = i32;

    fn apply(&mut self, setpoint: i32) {
        note(format!("motor {setpoint}"));
    }

    fn stop(&mut self) {
        note("motor stop");
    }
}

tasks! {
    enum Task { Script, Motors }
}

/// The sizes of the robot's memory for other robots.
const SIZES: Sizes = Sizes { neighbors: 2, bearings: true, entries: 2, swarms: 2 };

/// Compiles a script that may call `motor(int)` and `work(us)`.
pub fn image(source: &str) -> Vec<u8> {
    let robot = "name = \"fake\"\ntitle = \"none\"\nchip = \"none\"\nprofile = \"full\"\ntick_hz = 10\nmessage_bytes = 48\n\
        [vm]\nmemory = 5000\nslots = 400\nneighbors = 1\nin_queue = 1\nout_queue = 1\nstigmergy_entries = 1\nswarms = 1\n\
        [budget]\nflash_bytes = 65536\nram_bytes = 8000\n\
        [[function]]\nname = \"motor\"\naccepts = [\"power: int\"]\nhelp = \"turn\"\n\
        [[function]]\nname = \"work\"\naccepts = [\"us: int\"]\nhelp = \"takes time\"\n";
    let robot = bittybuzz_robot_spec::Robot::parse(robot, "fake.toml").expect("robot");
    let options = Options {
        profile: Some(bittybuzz_robot_spec::NumberProfile::Full),
        robot: Some(robot.clone()),
        robots: vec![robot],
        ..Options::default()
    };
    let loader = IncludeLoader::new(&DiskFiles);
    let compiled = compile(Path::new("test.bzz"), source.to_owned(), &loader, &options);
    compiled.image.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics))
}

/// Runs a script and its motors for `ms` ms, in steps of 100 µs, and returns the events.
pub fn run(source: &str, ms: u64) -> Events {
    run_image(&image(source), ms)
}

pub fn run_image(image: &[u8], ms: u64) -> Events {
    run_hearing(image, Vec::new(), ms)
}

/// Runs an image on a robot that receives these frames.
pub fn run_hearing(image: &[u8], radio: Frames, ms: u64) -> Events {
    run_robot::<false>(image, radio, ms)
}

/// Runs an image on a robot that receives these frames. With `ON_FAULT_STOPS` every fault stops the
/// script for good.
pub fn run_robot<const ON_FAULT_STOPS: bool>(image: &[u8], radio: Frames, ms: u64) -> Events {
    let _turn = clock();
    take_events();
    let channel: &'static Channel<i32> = Box::leak(Box::new(Channel::new()));
    let liveness: &'static Liveness<Task> = Box::leak(Box::new(Liveness::new()));
    let image: &'static [u8] = Box::leak(image.to_vec().into_boxed_slice());
    let robot = Fake::<ON_FAULT_STOPS> { setpoint: SetpointWriter::new(channel), radio };
    let vm = Box::leak(Box::new(Vm::new()));
    vm.set_network_capacity(SIZES);
    let mut script: ScriptTask<Full, &[u8], Fake<ON_FAULT_STOPS>, 400> =
        ScriptTask::new(vm, 7, robot, liveness.pulse(Task::Script), Box::leak(Box::new([0; 1024])));
    let both = async {
        let _ = script
            .run(|vm| vm.load(Image::new(image), is_function), 1, Duration::from_hz(10))
            .await;
        script.rest().await
    };
    let mut motors = FakeMotors;
    let drive =
        bittybuzz_runtime::setpoint::drive(channel, &mut motors, liveness.pulse(Task::Motors));
    let (mut both, mut drive) = (pin!(both), pin!(drive));
    let mut context = Context::from_waker(Waker::noop());
    let mut alive_at = 0;
    while now_ms() < ms {
        let before = Instant::now();
        assert!(poll(both.as_mut(), &mut context).is_pending());
        assert!(poll(drive.as_mut(), &mut context).is_pending());
        if liveness.all_live() {
            alive_at = now_ms();
        }
        assert!(now_ms() - alive_at <= 60, "a task shows no sign of life");
        // A script that calls `work` advances the clock itself.
        if Instant::now() == before {
            advance_us(100);
        }
    }
    take_events()
}

fn poll<F: Future>(future: std::pin::Pin<&mut F>, context: &mut Context<'_>) -> Poll<F::Output> {
    future.poll(context)
}
