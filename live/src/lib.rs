//! The protocol between a client, such as a web page, and a session of the simulator or a
//! recording: the client sends requests, and receives events and samples.
//!
//! A [`Source`] takes requests as JSON text, and returns events as JSON text and samples as bytes.
//! [`Live`] is a session, [`Replay`] is a recording, and [`Watched`] are robots outside the
//! simulator that report. The caller transports the messages: through a WebSocket of `bbz`, or
//! to a worker in the browser that runs the simulator as WebAssembly.
//!
//! # Principles
//! 1. **Time comes from the caller.** The crate reads no clock, so that it runs everywhere and
//!    tests do not wait.
//! 2. **A slow client costs no memory.** It takes samples less often, and then gets the newest one.
//!    Of the log lines and faults since the last time it gets the newest 500 and the number of the
//!    others; all other events wait for it.
//! 3. **A client may send anything.** An invalid request changes nothing; the answer is an event
//!    with the reason.
//!
//! # Requests
//! | Request | Effect |
//! |---|---|
//! | `{"play":{"rate":2}}` | run at `rate` times real time, 0.1 to 1000; without it unlimited. At its end the run starts again at the beginning |
//! | `"pause"` | pause |
//! | `{"step":{"ticks":1}}` | run for this number of ticks, then pause |
//! | `{"go_to":{"tick":100}}` | go to a tick, back or forward, and pause. A long way takes several turns, with an event about the time that is left; requests about the run wait for its end, another `go_to` replaces it, and `pause` ends it |
//! | `{"command":{"text":"fail = 3"}}` | the command of the text acts at the next tick; while the run is paused, an event has the answers to questions at once |
//! | `{"inspect":{"robot":5}}` | after each sample an event has the memory of the robot with this number; `null`: no more |
//! | `{"watch":{"messages":true,"quantity":"led"}}` | after each sample an event has the messages since the one before, and one has the quantity, which is written as in `plot` (docs/scenario.md); `false` and `null`: no more |
//! | `{"series":{"quantities":["led","x"],"robots":[5]}}` | events have points of these curves from the beginning of the run up to now, at most 2,000 each: extremes and quartiles of all robots, and the values of the robots with these numbers. Points of the past are computed next to the session |
//! | `"stop_series"` | points of the past that are not known yet are not computed |
//! | `"undo"`, `"redo"` | the last change of the commands is undone, or done again; the run is then the one to which only the commands that remain were given |
//! | `{"delete_command":{"number":2}}` | the command with this number in the list of `conditions` is left out, as by `undo` |
//! | `"commands"` | an event has all commands, as the text of `[[event]]`s |
//! | `"scenario"` | an event has the scenario with all commands as its last events, and with the scripts in it: it replays the session from any folder |
//! | `{"script":{"name":"walk.bzz"}}` | an event has the text of a script, and the names that it may use |
//! | `{"check":{"name":"walk.bzz","text":"…"}}` | an event has the compiler's messages about a text in the place of the script |
//! | `{"run":{"texts":{"walk.bzz":"…"},"keep_changes":true}}` | the run starts again from the beginning with these texts of scripts and of the scenario; with `keep_changes` the commands act again at their times |
//! | `{"build":{"edit":{"delete":{"thing":{"kind":"lamp","number":0}}},"texts":{}}}` | a thing of the world is added, changed, copied or deleted in the text of the scenario, and the run starts again from the beginning, as for `run` |
//! | `{"load":{"name":"walk.bzz","text":"…","robots":[3],"keep":true}}` | the robots with these ids get the text as a draft of the script, by a command; without `robots` all that have the script. With `keep` their globals keep numbers |
//! | `{"write":{"name":"walk.bzz","text":"…","over":"…"}}` | the text is written to the file of the script, if the client may, and if the file has the text with this SHA-256; without `over` whatever the file has |
//! | `{"unsaved":{"name":"walk.bzz","text":"…","over":"…"}}` | the text is kept for the next session, which offers it; `null`: no text is unsaved |
//! | `{"discard":{"id":"…"}}` | a text that was offered is forgotten |
//! | `{"explain":{"code":"E0201"}}` | an event has the explanation of a message of the compiler, in Markdown |
//! | `{"sweep":{"key":"medium.ir.loss","values":["0","0.3"],"seeds":5,"quantity":"led"}}` | trials next to the session: the scenario from its start with the last drafts, each value with that number of seeds; the key may be a global, as `global.JOIN` |
//! | `{"hand_in":{"by":"Ada","texts":{"walk.bzz":"…"}}}` | a trial whose result is an event with a file for `bbz grade`, if the run began with these texts |
//! | `{"grade":{"files":{"ada.json":"…"}}}` | trials of files that were handed in, whose result is an event with their marks |
//! | `"stop_trials"` | trials that were not finished are given up |
//! | `{"stop_on_error":{"on":true}}` | the run pauses at the end of a tick in which a script has a fault, and an event names the robot and the reason; on from the start in a scenario with an assignment |
//! | `{"debug":{"robot":5,"to":"next"}}` | an event has the next statement of the script of the robot with this number, and the memory before it, while the world waits: the run is at the beginning of the tick in which the statement is. Also `first`, `over`, `out`, `back`, `last` and `{"at":3}`. Past the last statement of a tick, the run goes on to the next one |
//! | `{"breakpoints":{"lines":{"walk.bzz":[3]},"robot":5}}` | the run pauses before the tick in which a robot, or the one with this number alone, reaches one of these lines, and an event has the statement as for `debug` |
//! | `"digest"` | an event has the digest of the run, in hexadecimal: runs that went the same way have the same one |
//!
//! # Events
//! An event is a [`PageEvent`]; in JSON, its key `event` names the variant. The file
//! bbz/page/editor/events.d.ts declares events and requests for the scripts of the page, which are
//! checked against it.
//!
//! A recording supports only `play`, `pause`, `step` and `go_to`. Its `begin` has the key
//! `recording`, and its ticks are those of its samples. Watched robots support no request; their
//! `begin` has the key `watched`.
//!
//! # Samples
//! A sample is the next piece of a recording (docs/recording.md). A piece that begins with the
//! recording's magic bytes starts a new recording, for example after a step back.
//!
//! # What it will not do
//! Write files (the caller's [`Workshop`] and [`UnsavedStore`] do; a [`Shelf`] is a workshop in memory;
//! [`ScenarioFiles`] only reads), listen on a network, draw.

mod about;
mod answers;
mod backlog;
mod band;
mod begin;
mod by_hand;
mod changes;
mod compiler_message;
mod conditions;
mod controls;
mod defect;
mod edit;
mod events;
mod faults;
mod grading;
mod hand_in;
mod inspection;
mod live;
mod pace;
mod page_event;
mod relative;
mod replay;
mod reports;
mod request;
mod samples;
mod scenario_comments;
mod scenario_files;
mod series;
mod set_up;
mod shelf;
mod source;
mod stepping;
mod trials;
mod unsaved;
mod watch;
mod watched;
mod words;
mod workshop;

pub use compiler_message::{CompilerMessage, MessageSeverity};
pub use defect::Defect;
pub use grading::{Assignment, Graded, Mark, Results, marks_csv};
pub use hand_in::{HandIn, TextFile, sha256};
pub use live::Live;
pub use page_event::{DefectEvent, PageEvent};
pub use relative::relative;
pub use replay::Replay;
pub use scenario_comments::{ScenarioWarning, scenario_warnings};
pub use scenario_files::{ScenarioFiles, environment_folders, program_of, programs, text_of};
pub use set_up::set_up;
pub use shelf::{SharedFiles, Shelf};
pub use source::Source;
pub use unsaved::{KeptText, UnsavedStore};
pub use watched::{ReportContent, RobotReport, Watched};
pub use workshop::Workshop;
