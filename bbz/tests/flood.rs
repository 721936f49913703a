//! Floods between `bbz sim --view` and its page, in both directions, and its end under load.

#![cfg(all(feature = "view", target_os = "linux"))]

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, ExitStatus};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::support::Folder;
use crate::support::client::Client;

/// The most memory of a command that shows 200 robots, in MB. Without a page it takes a tenth.
const PEAK_MAX: u64 = 100;

/// The longest wait for what takes milliseconds otherwise.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// Robots that log in a loop.
const LOUD: &str = "n = 0\n\
    function step() { for(n = 0, n < 20, n = n + 1) log(\"line \", n) neighbors.broadcast(\"n\", n) }\n";

const SCENARIO: &str = "[world]\nsize = [4000, 4000]\nduration = 100000\n\n\
    [[robots]]\nrobot = \"zooids\"\nscript = \"loud.bzz\"\ncount = 200\n";

/// A running command.
struct Shown {
    child: Child,
    url: String,
}

impl Shown {
    fn start(folder: &Folder) -> Self {
        let arguments = ["sim", "s.toml", "--view", "--no-browser"];
        let mut child =
            folder.command(&arguments).env("XDG_STATE_HOME", folder.path("state")).spawn().unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut url).unwrap();
        Shown { child, url: url.trim().to_owned() }
    }

    /// Returns the processor time that the command has used, in ticks of 10 ms.
    fn used(&self) -> u64 {
        let line = fs::read_to_string(format!("/proc/{}/stat", self.child.id())).unwrap();
        let (_, fields) = line.rsplit_once(") ").unwrap();
        let fields: Vec<&str> = fields.split(' ').collect();
        fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
    }

    /// Waits until the command has worked for some seconds more.
    fn work(&self, seconds: u64) {
        let (end, begin) = (self.used() + 100 * seconds, Instant::now());
        while self.used() < end && begin.elapsed() < WAIT_MAX {
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Returns the largest resident memory of the command until now, in MB.
    fn peak_mb(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024 / 1_000_000
    }

    /// Ends the command as Ctrl-C does, and returns its status.
    fn interrupt(mut self) -> ExitStatus {
        let process = nix::unistd::Pid::from_raw(self.child.id() as i32);
        nix::sys::signal::kill(process, nix::sys::signal::Signal::SIGINT).unwrap();
        let begin = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(begin.elapsed() < WAIT_MAX, "the command does not end");
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        // The command may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// 200 robots log in a loop, without a limit of the rate, and the page does not read.
#[test]
fn a_page_that_does_not_read_costs_no_memory() {
    let folder = Folder::with("flood-log", "loud.bzz", LOUD);
    folder.write("s.toml", SCENARIO);
    let shown = Shown::start(&folder);
    let mut client = Client::connect(&shown.url);
    client.event("begin");
    client.send(json!({ "watch": { "messages": true, "quantity": "led" } }));
    client.send(json!({ "play": {} }));
    shown.work(5);
    let peak = shown.peak_mb();
    assert!(peak < PEAK_MAX, "{peak} MB");
    // The page gets the newest lines when it reads again, and the number of the others.
    client.send(json!("pause"));
    let lost = loop {
        let logs = client.event("logs");
        let lost = logs["lost"].as_u64().unwrap();
        if lost > 0 {
            break lost;
        }
    };
    assert!(lost > 1000, "{lost}");
    assert!(shown.interrupt().success());
}

/// The command reads no more requests than it can answer, and ends although they go on.
#[test]
fn a_flood_of_requests_neither_costs_memory_nor_holds_the_command() {
    let folder = Folder::with("flood-requests", "loud.bzz", LOUD);
    folder.write("s.toml", SCENARIO);
    let script = json!({ "script": { "name": "s.toml" } });
    let cases = [
        (json!("pause"), true),
        (json!("pause"), false),
        (json!("scenario"), true),
        (script, false),
    ];
    for (request, reads) in cases {
        let shown = Shown::start(&folder);
        let sent = Arc::new(AtomicU64::new(0));
        let mut clients = [0, 1].map(|_| Client::connect(&shown.url));
        clients[1].event("begin");
        // The first one waits, and asks whether there is an answer.
        let [waiting, current] = clients;
        let flood = |mut client: Client, text: String| {
            let sent = sent.clone();
            if reads {
                client.drain();
            }
            thread::spawn(move || {
                while client.send_text(&text).is_ok() {
                    sent.fetch_add(1, Ordering::Relaxed);
                }
            })
        };
        let floods = [flood(waiting, "ping".to_owned()), flood(current, request.to_string())];
        shown.work(2);
        let peak = shown.peak_mb();
        assert!(peak < PEAK_MAX, "{peak} MB, {request}");
        assert!(shown.interrupt().success(), "{request}");
        floods.into_iter().for_each(|flood| flood.join().unwrap());
        assert!(sent.load(Ordering::Relaxed) > 8);
    }
}

/// In a tick, 60,000 robots send a message that each of the others hears: it takes minutes.
#[test]
fn the_command_ends_within_a_tick() {
    let folder =
        Folder::with("flood-tick", "s.bzz", "function step() { neighbors.broadcast(\"n\", 1) }\n");
    folder.write(
        "s.toml",
        SCENARIO.replace("4000", "200000").replace("loud", "s").replace("200\n", "60000\n"),
    );
    let shown = Shown::start(&folder);
    let mut client = Client::connect(&shown.url);
    client.event("begin");
    client.send(json!({ "play": {} }));
    shown.work(4);
    assert!(shown.interrupt().success());
}
