//! Measures the speed of the engine with Kilobots that wander and send two frames per second, with
//! contacts and collisions of frames.
//!
//! `cargo run --locked --release -p bittybuzz-arena --example speed [THREADS [ROBOTS NEIGHBORS]]`
//! prints, for each number of robots and of neighbors in range, robot-seconds per second and
//! memory per robot. The memory is the growth of the process, with brains and, in small worlds, the
//! stacks of the threads.

use std::sync::Arc;
use std::time::Instant;

use bittybuzz_arena::engine::{Area, Brain, Io, Media, Pose, Stream, World, WorldSettings};
use bittybuzz_kilobot_model::{KilobotModel, KilobotMotors};

/// A brain that walks straight and in curves, counts the frames that it receives, and sends all the
/// time.
struct Wanderer {
    stream: Stream,
    received: u32,
    nearest: f32,
}

impl Brain for Wanderer {
    fn tick(&mut self, io: &mut Io<'_>) {
        for frame in io.inbox.iter() {
            self.received += u32::from(frame.bytes[0] == 5);
            if let Some([distance, ..]) = frame.sighting.place() {
                self.nearest = self.nearest.min(distance);
            }
        }
        if io.now % 20 == u64::from(io.id.0 % 20)
            && let Some(motors) = io.controls::<KilobotMotors>()
        {
            (motors.left, motors.right) = match self.stream.below(4) {
                0 => (70, 0),
                1 => (0, 70),
                _ => (70, 70),
            };
        }
    }

    fn has_frame(&self) -> bool {
        true
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        frame[0] = 5;
        frame.len()
    }
}

fn world(robots: usize, neighbors: f32, threads: usize) -> World<Wanderer> {
    let mut settings = WorldSettings { seed: 1, threads, ..WorldSettings::default() };
    let (model, media) = (KilobotModel::STANDARD, Media::STANDARD);
    let reach = media.infrared.link.range.unwrap_or(0.0) + 2.0 * model.radius;
    let area = robots as f32 * core::f32::consts::PI * reach * reach / neighbors;
    settings.area = Area { width: area.sqrt(), height: area.sqrt() };
    let mut world = World::new(settings).expect("settings");
    let herd = world.add_herd(Arc::new(model), media).expect("numbers");
    // The robots start in a loose lattice, because random places would begin with little else than
    // contacts.
    let columns = (robots as f32).sqrt().ceil();
    let pitch = area.sqrt() / columns;
    for robot in 0..robots {
        let mut stream = Stream::for_brain(1, robot as u16);
        let place =
            |index: f32, chance: f32| (index + 0.5 + 0.4 * (chance - 0.5) - columns / 2.0) * pitch;
        let (column, row) = (robot as f32 % columns, (robot as f32 / columns).floor());
        let pose = Pose::new(
            place(column, stream.unit()),
            place(row, stream.unit()),
            stream.unit() * core::f32::consts::TAU,
        );
        let brain = Wanderer { stream, received: 0, nearest: f32::MAX };
        world.add(herd, pose, brain).expect("robot");
    }
    world
}

/// Returns the memory of this process in bytes, if the system reports it.
fn resident() -> Option<usize> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(pages.split_whitespace().nth(1)?.parse::<usize>().ok()? * 4096)
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<usize> =
        std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    if let [threads, robots, neighbors] = arguments[..] {
        measure(threads, robots, neighbors as f32);
        return Ok(());
    }
    println!("robots  neighbors  robot-s/s  bytes/robot  heard/robot/s  collided  contact");
    let threads = arguments.first().copied().unwrap_or(0);
    for neighbors in [5, 10, 20] {
        for robots in [100, 1000, 5000, 20_000] {
            // Each case has a process of its own, so that none uses the memory of the last one.
            let case = [threads, robots, neighbors].map(|number| number.to_string());
            std::process::Command::new(std::env::current_exe()?).args(case).status()?;
        }
    }
    Ok(())
}

fn measure(threads: usize, robots: usize, neighbors: f32) {
    let before = resident();
    let mut world = world(robots, neighbors, threads);
    for _ in 0..100 {
        world.tick();
    }
    let ticks = 6_000_000 / robots;
    let old = world.statistics().all_links();
    let touched = world.statistics().contact_ticks;
    let begin = Instant::now();
    for _ in 0..ticks {
        world.tick();
    }
    let seconds = begin.elapsed().as_secs_f64();
    let simulated = (robots * ticks) as f64 / 10.0;
    let bytes = before
        .zip(resident())
        .map_or("-".to_owned(), |(before, after)| ((after - before) / robots).to_string());
    let links = world.statistics().all_links();
    let received = (links.received - old.received) as f64;
    let collided = (links.collided - old.collided) as f64;
    let touching = (world.statistics().contact_ticks - touched) as f64;
    println!(
        "{robots:>6}  {neighbors:>10}  {:>9.0}  {bytes:>11}  {:>13.1}  {:>7.1}%  {:>6.1}%",
        simulated / seconds,
        received / simulated,
        100.0 * collided / (received + collided),
        10.0 * touching / simulated,
    );
}
