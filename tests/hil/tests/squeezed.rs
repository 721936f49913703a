//! An image that is built with squeeze and one without do the same in each step: LED, motors and messages, with the same values in
//! the same order.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bittybuzz_hil::{Command, EmulatorEvent, Kilobots};

/// Steps that are compared.
const STEPS: usize = 300;
/// Length of a step.
const STEP: Duration = Duration::from_millis(100);
/// A message comes so long after the beginning of a step: the step is over then in both images.
const MESSAGE_AT: Duration = Duration::from_millis(60);
/// Bytes of a message without its checksum.
const MESSAGE: usize = 10;

/// The messages that another robot with this image sends.
fn messages(image: &Path) -> Vec<Vec<u8>> {
    let mut robots = Kilobots::with_program(image, 2);
    robots.start();
    robots.run_for(STEP * STEPS as u32);
    robots.sent(1).iter().map(|(_, frame)| frame[..MESSAGE].to_vec()).collect()
}

/// Everything that can be seen of a robot.
#[derive(Default)]
struct Seen {
    /// Changes of LED and motors, one list for each step.
    steps: Vec<Vec<EmulatorEvent>>,
    /// Messages. A message may come before the end of a step in one image and after it in the other, because it is sent by the clock.
    sent: Vec<Vec<u8>>,
}

/// Runs an image that receives a message in every second step.
fn seen(image: &Path, chip: &str, messages: &[Vec<u8>]) -> Seen {
    let mut robots = Kilobots::on_chip(chip, image, 1);
    robots.start();
    for step in 0..STEPS {
        if let (0, Some(message)) = (step % 2, messages.get(step / 2)) {
            let at = robots.now() + MESSAGE_AT;
            robots.execute_on(0, &Command::Radio { at, payload: message.clone() });
        }
        robots.run_for(STEP);
    }
    let mut seen = Seen { steps: vec![Vec::new()], sent: Vec::new() };
    for event in std::mem::take(&mut robots.events[0]) {
        match event.event {
            EmulatorEvent::Step => seen.steps.push(Vec::new()),
            EmulatorEvent::Infrared { payload, .. } => seen.sent.push(payload),
            event => seen.steps.last_mut().expect("there is one").push(event),
        }
    }
    seen
}

#[test]
#[ignore = "needs images: `cargo xtask soak squeezed`"]
fn both_images_do_the_same_in_each_step() {
    let variable =
        |name: &str| std::env::var_os(name).expect("`cargo xtask soak squeezed` sets it");
    let [squeezed, plain] =
        ["BITTYBUZZ_SQUEEZED", "BITTYBUZZ_PLAIN"].map(variable).map(PathBuf::from);
    let chip = variable("BITTYBUZZ_PLAIN_CHIP");
    let messages = messages(&squeezed);
    let with = seen(&squeezed, "atmega328p", &messages);
    let without = seen(&plain, &chip.to_string_lossy(), &messages);
    for (step, (with, without)) in with.steps.iter().zip(&without.steps).enumerate() {
        assert_eq!(with, without, "step {step}");
    }
    for (number, (with, without)) in with.sent.iter().zip(&without.sent).enumerate() {
        assert_eq!(with, without, "message {number}");
    }
    assert_eq!(with.steps.len(), without.steps.len());
    assert!(with.sent.len().abs_diff(without.sent.len()) <= 1);
    assert!(with.steps.len() >= STEPS - 5, "{} steps", with.steps.len());
    let changes: usize = with.steps.iter().map(Vec::len).sum();
    println!(
        "compared: {} steps, {changes} changes of LED and motors, {} messages sent, {} received",
        with.steps.len(),
        with.sent.len(),
        messages.len()
    );
}
