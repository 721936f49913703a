//! The same frames for a virtual machine in this process and for a Zooid's image: after each step both know the same, and in
//! the end the same writer has won, key by key.
//!
//! Frames are those of a run of six images, replayed to a seventh robot: as they were, with half of them missing, late and
//! out of order, and doubled.

use std::collections::BTreeMap;
use std::time::Duration;

use bittybuzz_comms::nrf24::Payload;
use bittybuzz_hil::{EmulatorEvent as HilEvent, Place, Table, TimedEvent, image_for};
use bittybuzz_testkit::{Event, Queues, Random, Received, RecordedArgument, Recorder};
use bittybuzz_vm_core::builtin::STRINGS;
use bittybuzz_vm_core::message::{Message, ScriptIdentity, StigmergyEntry, TINY_FRAME};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{Image, Outcome, Periods, Value, Vm};

/// Writes for eight seconds: all robots the same key in the same step, so that clocks are equal; single ones at other times;
/// deletes too. The one stigmergy decides by value, the other one as the machine does.
const SCRIPT: &str = "\
function init() {
  n = 0
  a = stigmergy.create(1)
  a.onconflict(function(key, local, remote) {
    if(remote.data > local.data) return remote
    return local
  })
  b = stigmergy.create(2)
  a.put(0, 10 + id)
}
function step() {
  n = n + 1
  if(n < 80) {
    if(n % 20 == 0) b.put(0, 10 + (id * 7) % 23)
    if(n % 30 == 15) a.put(1, n + (id * 5) % 11)
    if((n + id * 13) % 29 == 0) b.put(1, n)
    if((n + id * 13) % 37 == 0) b.put(1, nil)
  }
  log(n, a.get(0), a.get(1), b.get(0), b.get(1), a.size(), b.size())
}
";

/// Steps that write, and all of them.
const WRITING: usize = 80;
const STEPS: usize = 129;
/// After this one a stranger asks for each key: long after the last frame that is late, since a robot that has just used up
/// its answers has the first one again after 16 steps, and all four after 22.
const ASKED: usize = 118;
const KEYS: [(u16, i32); 4] = [(1, 0), (1, 1), (2, 0), (2, 1)];
const STRANGER: u16 = 500;
const TICK: Duration = Duration::from_millis(100);

/// Packets and when they were sent.
type Trace = Vec<(Duration, Vec<u8>)>;
/// What the script has logged in a step.
type Known = Vec<String>;
/// Of each key the entry that a robot knows: value, clock and writer among its bytes.
type Winners = BTreeMap<(u16, i32), Vec<u8>>;

/// What six robots say that lose a fifth of what they hear.
fn recorded(seed: u64) -> Trace {
    let mut table = Table::new(SCRIPT, &[1, 2, 3, 4, 5, 6]);
    for robot in 0..6 {
        table.put(robot, Place::at(60.0 * robot as f64, 0.0, 0.0));
    }
    table.lose(0.2, seed);
    table.run_ms(100 * WRITING as u64);
    let robots = table.zooids().iter();
    let mut trace: Trace = robots.flat_map(|robot| robot.events.iter().filter_map(sent)).collect();
    trace.sort();
    trace
}

fn sent(event: &TimedEvent) -> Option<(Duration, Vec<u8>)> {
    match &event.event {
        HilEvent::Radio { payload, .. } => Some((event.at, payload.clone())),
        _ => None,
    }
}

/// The script as messages know it.
fn known_script(image: &[u8]) -> ScriptIdentity {
    let header = Image::new(image).header().unwrap();
    let strings = STRINGS.len() as u16 + header.strings();
    ScriptIdentity { hash: header.hash(), strings }
}

fn entry(message: &[u8], script: ScriptIdentity) -> Option<StigmergyEntry<Tiny>> {
    match Message::decode(message, script) {
        Ok(Message::Entry(entry)) => Some(entry),
        _ => None,
    }
}

/// `stranger` asks who knows the key.
fn question((stigmergy, key): (u16, i32), script: ScriptIdentity) -> Vec<u8> {
    let (key, value) = (Value::int(key), Value::nil());
    let entry = StigmergyEntry { stigmergy, owner: STRANGER, clock: 0, key, value };
    let mut frame = [0; TINY_FRAME];
    let length = Message::<Tiny>::Entry(entry).encode(script, &mut frame).unwrap();
    let mut room = [0; bittybuzz_comms::nrf24::PAYLOAD_MAX];
    let message = &frame[..length];
    let length = Payload { robot: STRANGER, position: None, message }.write(&mut room).unwrap();
    room[..length].to_vec()
}

/// The answers among messages.
fn winners<'a>(messages: impl Iterator<Item = &'a [u8]>, script: ScriptIdentity) -> Winners {
    let mut winners = Winners::new();
    for message in messages {
        let Some(entry) = entry(message, script).filter(|entry| entry.clock > 0) else { continue };
        let key = KEYS.into_iter().find(|(stigmergy, key)| {
            entry.stigmergy == *stigmergy && entry.key.as_int() == Some(*key)
        });
        winners.insert(key.unwrap(), message.to_vec());
    }
    winners
}

/// The image hears the trace. What it knows after each step, who has won, and what it has heard in each tick: while it sends
/// it is deaf.
fn on_image(
    id: u16,
    trace: &Trace,
    script: ScriptIdentity,
) -> (Vec<Known>, Winners, Vec<Vec<Vec<u8>>>) {
    let mut table = Table::new(SCRIPT, &[id]);
    let mut heard = vec![Vec::new(); STEPS];
    let mut questions = KEYS.map(|key| question(key, script)).into_iter();
    let asked = TICK * ASKED as u32;
    let mut packets: Trace = trace.clone();
    packets.extend(
        (20..)
            .step_by(20)
            .map(Duration::from_millis)
            .zip(&mut questions)
            .map(|(after, question)| (asked + after, question)),
    );
    let mut last = Duration::ZERO;
    for (at, payload) in packets {
        // Not while a step may begin, and not while another one is on the air.
        let mut at = at.max(last + Duration::from_micros(600));
        let within = at.as_micros() % TICK.as_micros();
        if within < 12_000 {
            at += Duration::from_micros(12_000 - within as u64);
        } else if within > 94_000 {
            at += Duration::from_micros((TICK.as_micros() - within) as u64 + 12_000);
        }
        last = at;
        let before = table.board(0).radio_received;
        table.radio(at, &payload);
        let until = at + Duration::from_micros(400);
        table.run(until.saturating_sub(table.now()));
        if table.board(0).radio_received > before {
            heard[(at.as_micros() / TICK.as_micros()) as usize].push(payload);
        }
    }
    table.run_ms(100 * STEPS as u64 + 50 - table.now().as_millis() as u64);
    let zooid = &table.zooids()[0];
    assert!(zooid.trace_log.records.is_empty(), "{:?}", zooid.trace_log.records);
    let log = zooid.trace_log.log.iter().map(|(_, values)| values.clone()).collect();
    let answers: Trace =
        zooid.events.iter().filter_map(sent).filter(|(at, _)| *at > asked).collect();
    let messages = answers.iter().filter_map(|(_, payload)| Payload::parse(payload));
    (log, winners(messages.map(|payload| payload.message), script), heard)
}

const SLOTS: usize = 1024;
const QUEUE: usize = 15;

/// The machine hears the same in each tick.
fn in_process(id: u16, heard: &[Vec<Vec<u8>>], image: &[u8]) -> (Vec<Known>, Winners) {
    let zooid = bittybuzz_robot_files::find("zooids").unwrap();
    assert_eq!([zooid.vm.in_queue, zooid.vm.out_queue], [QUEUE as u32; 2]);
    let mut vm: Box<Vm<Tiny, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(zooid.sizes());
    vm.load_limited(Image::new(image), zooid.vm.slots as usize, |_| false).unwrap();
    vm.set_robot_id(id, 0);
    let steps = |steps: u32| u8::try_from(steps).unwrap();
    let periods = Periods {
        beacon: steps(zooid.vm.beacon_steps),
        forget: steps(zooid.vm.forget_steps),
        advertise: steps(zooid.vm.advertise_steps),
    };
    let mut host = Recorder { periods, ..Recorder::default() };
    host.link = Box::new(Queues::<Tiny, QUEUE, QUEUE>::default());
    let mut run = |host: &mut Recorder, entry| {
        assert!(vm.begin(entry));
        assert!(matches!(vm.run(host, 60_000), Outcome::Done));
        vm.unwanted_topics()
    };
    run(&mut host, bittybuzz_vm_core::Entry::Global);
    let mut unwanted = run(&mut host, bittybuzz_vm_core::Entry::Init);
    let mut answers = Vec::new();
    for (tick, heard) in heard.iter().enumerate() {
        for payload in heard {
            let Payload { robot: sender, message, .. } = Payload::parse(payload).unwrap();
            host.link.push(Received { sender: Some(sender), ..Received::new(message) });
        }
        host.link.begin_step(unwanted);
        unwanted = run(&mut host, bittybuzz_vm_core::Entry::Step);
        while let Some(frame) = host.link.pop_sent() {
            if tick >= ASKED {
                answers.push(frame);
            }
        }
    }
    let log = host.events.iter().map(|event| match event {
        Event::Log(items) => items.iter().map(RecordedArgument::to_string).collect(),
        other => panic!("the script only logs: {other:?}"),
    });
    let log = log.collect();
    (log, winners(answers.iter().map(Vec::as_slice), known_script(image)))
}

/// Both hear the trace; who has won, with a listener that is sure to answer each question.
fn replay(what: &str, id: u16, trace: &Trace, image: &[u8]) -> Winners {
    let (log, winners, heard) = on_image(id, trace, known_script(image));
    let count: usize = heard.iter().map(Vec::len).sum();
    // It is deaf while it sends, for some 0.3 ms each time.
    assert!(count * 10 > trace.len() * 9, "{what}: {count} of {} heard", trace.len());
    let (log_in_process, winners_in_process) = in_process(id, &heard, image);
    assert_eq!(log.len(), STEPS);
    for (step, (image, machine)) in log.iter().zip(&log_in_process).enumerate() {
        assert_eq!(image, machine, "{what}, step {}", step + 1);
    }
    assert_eq!(winners.len(), KEYS.len(), "{what}: {winners:x?}");
    assert_eq!(winners, winners_in_process, "{what}");
    winners
}

#[test]
fn the_same_frames_have_the_same_winner_in_a_machine_and_in_an_image() {
    let image = image_for("zooids", SCRIPT);
    let script = known_script(&image);
    let mut owners = std::collections::BTreeSet::new();
    for (seed, id) in [(1, 0), (2, 99)] {
        let whole = recorded(seed);
        let mut random = Random::new(seed);
        assert!(whole.len() > 300, "{}", whole.len());
        // Two writers at the same clock, the hardest case: there are some.
        let mut writers = BTreeMap::new();
        for (_, payload) in &whole {
            let message = Payload::parse(payload).unwrap().message;
            let Some(entry) = entry(message, script) else { continue };
            let key = entry.key.as_int().unwrap();
            let at_clock = writers.entry((entry.stigmergy, key, entry.clock));
            at_clock.or_insert_with(std::collections::BTreeSet::new).insert(entry.owner);
        }
        assert!(writers.values().filter(|writers| writers.len() > 1).count() > 5, "{writers:?}");
        let half = whole.iter().filter(|_| random.below(2) == 0).cloned().collect();
        let mut late: Trace = whole
            .iter()
            .map(|(at, payload)| (*at + Duration::from_millis(random.below(500)), payload.clone()))
            .collect();
        late.sort();
        let again = |(at, payload): &(Duration, Vec<u8>)| {
            [(*at, payload.clone()), (*at + Duration::from_millis(150), payload.clone())]
        };
        let mut doubled: Trace = whole.iter().flat_map(again).collect();
        doubled.sort();
        for (what, trace) in
            [("whole", &whole), ("half", &half), ("late", &late), ("doubled", &doubled)]
        {
            let winners = replay(&format!("seed {seed}, {what}"), id, trace, &image);
            for message in winners.values() {
                let entry = entry(message, script).unwrap();
                let StigmergyEntry { stigmergy, owner, clock, key, value } = entry;
                let (key, value) = (key.as_int().unwrap(), value.as_int());
                println!(
                    "seed {seed}, {what}: {stigmergy}, {key}: {value:?} at {clock} by {owner}"
                );
                owners.insert(owner);
            }
        }
    }
    // It is not always the listener, nor always the same robot.
    assert!(owners.len() > 2, "{owners:?}");
}
