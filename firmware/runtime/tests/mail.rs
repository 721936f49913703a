//! Swarm messages between tasks: the waiting frames, the replaced ones, and the times of sending.

use std::cell::RefCell;
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use crate::common::{advance_us, clock};
use bittybuzz_runtime::liveness::Liveness;
use bittybuzz_runtime::mail::{Mail, MailQueues};
use bittybuzz_runtime::tasks;
use bittybuzz_vm_core::number::{Full, Rng};
use bittybuzz_vm_core::{Sighting, Value};
use embassy_time::Instant;

type SmallMail = Mail<Full, 20, 3, 3, 1, 1>;

/// Returns a broadcast of a robot on a topic, in the format of docs/wire-format.md: type, robot,
/// topic, value, hash.
fn broadcast(robot: u16, topic: u8, value: u8) -> Vec<u8> {
    let robot = robot.to_le_bytes();
    vec![0x05, robot[0], robot[1], topic, 0, 0, 0, value, 0, 0, 0, 1, 2, 3]
}

fn seen(robot: u16) -> Sighting<Full> {
    Sighting { robot: Some(robot), place: Some([1.5, -0.5, 0.25].map(Value::float)) }
}

#[test]
fn the_script_gets_received_messages_and_their_senders() {
    let mail = SmallMail::new();
    let (mut frame, mut sighting) = ([0; 20], Sighting::default());
    assert!(mail.receive(&mut frame, &mut sighting).is_none());
    mail.add_received(&broadcast(7, 1, 1), seen(7));
    let length = mail.receive(&mut frame, &mut sighting).expect("a frame");
    assert_eq!(frame[..length], broadcast(7, 1, 1));
    assert_eq!(sighting.robot, Some(7));
    let place = sighting.place.expect("a place").map(|value| value.as_f32().unwrap());
    assert_eq!(place, [1.5, -0.5, 0.25]);
    assert!(mail.receive(&mut frame, &mut sighting).is_none());
}

/// 100 messages arrive between two steps. Three wait, the others are counted, and so are
/// duplicates.
#[test]
fn frames_without_room_are_counted() {
    let mail = SmallMail::new();
    (0..100).for_each(|n| mail.add_received(&broadcast(7, n, 1), seen(7)));
    mail.add_received(&broadcast(7, 99, 1), seen(7));
    assert_eq!((mail.unread().dropped, mail.unread().duplicates), (97, 1));
    let (mut frame, mut sighting) = ([0; 20], Sighting::default());
    let received = std::iter::from_fn(|| mail.receive(&mut frame, &mut sighting)).count();
    assert_eq!(received, 3);
    // One frame is too long, and the others are of no known type.
    mail.add_received(&[0x05; 21], seen(7));
    mail.add_received(&[0x01; 9], seen(7));
    mail.add_received(&[], seen(7));
    assert!(mail.receive(&mut frame, &mut sighting).is_none());
    (0..5).for_each(|n| mail.send(&broadcast(1, n, 1)));
    assert_eq!(mail.unsent().dropped, 2);
}

tasks! {
    enum Task { Radio }
}

/// Returns the frames that are sent and their times in µs, if the script sends `frames` at 0.
fn sent(mail: &SmallMail, seed: u16, frames: &[Vec<u8>], us: u64) -> Vec<(u64, Vec<u8>)> {
    let liveness: &'static Liveness<Task> = Box::leak(Box::new(Liveness::new()));
    let sent = RefCell::new(Vec::new());
    let transmit =
        |frame: &[u8]| sent.borrow_mut().push((Instant::now().as_micros(), frame.to_vec()));
    let mut drain = pin!(mail.drain(Rng::new(0, seed), liveness.pulse(Task::Radio), transmit));
    let mut context = Context::from_waker(Waker::noop());
    frames.iter().for_each(|frame| mail.send(frame));
    let mut alive_at = 0;
    while Instant::now().as_micros() < us {
        assert_eq!(drain.as_mut().poll(&mut context), Poll::Pending);
        if liveness.all_live() {
            alive_at = Instant::now().as_millis();
        }
        assert!(Instant::now().as_millis() - alive_at <= 60, "no sign of life");
        advance_us(100);
    }
    sent.take()
}

/// A robot sends at most one frame in 2 ms, so that it does not occupy the channel. The first frame
/// waits too, since all robots may step at once.
#[test]
fn frames_are_sent_apart_and_none_at_once() {
    let _turn = clock();
    let frames: Vec<Vec<u8>> = (0..3).map(|n| broadcast(1, n, n)).collect();
    let sent = sent(&SmallMail::new(), 1, &frames, 100_000);
    assert_eq!(sent.iter().map(|(_, frame)| frame.clone()).collect::<Vec<_>>(), frames);
    let mut before = 0;
    for (at, _) in sent {
        assert!((2_000..18_200).contains(&(at - before)), "{at} after {before}");
        before = at;
    }
}

/// Frames of 0.4 ms from ten robots that step at the same time seldom overlap.
#[test]
fn robots_that_step_together_do_not_send_together() {
    let _turn = clock();
    let mut times = Vec::new();
    for robot in 0..10 {
        embassy_time::MockDriver::get().reset();
        times.extend(sent(&SmallMail::new(), robot, &[broadcast(robot, 1, 1)], 30_000));
    }
    assert_eq!(times.len(), 10);
    let times: Vec<u64> = times.into_iter().map(|(at, _)| at).collect();
    let is_alone = |at: &u64| times.iter().filter(|other| other.abs_diff(*at) < 400).count() == 1;
    let alone = times.iter().filter(|at| is_alone(at)).count();
    assert!(alone >= 4, "{alone}: {times:?}");
}

/// A broadcast of an earlier step is replaced by a newer one on its topic; one of the same step is
/// not.
#[test]
fn stale_broadcasts_are_not_sent() {
    let _turn = clock();
    let mail = SmallMail::new();
    mail.send(&broadcast(1, 1, 1));
    mail.begin_step(0);
    let frames = [broadcast(1, 1, 2), broadcast(1, 1, 3)];
    let sent = sent(&mail, 1, &frames, 100_000);
    assert_eq!(sent.into_iter().map(|(_, frame)| frame).collect::<Vec<_>>(), frames);
}
