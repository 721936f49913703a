//! `bbz sim --view` from the side of its page: the way to the address, files that it reads and writes, texts that survive a
//! crash, and saved sessions.

#![cfg(feature = "view")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Child;
use std::time::Duration;

use serde_json::{Value, json};

use crate::support::Folder;
use crate::support::client::Client;

/// The longest wait for an answer, which takes milliseconds otherwise.
const WAIT_MAX: Duration = Duration::from_secs(60);

const SCRIPT: &str = "n = 0\nfunction step() { n = n + 1 led(n % 8) }\n";

const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 20\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n";

/// A running command and the page that is connected to it. The command ends with this value.
struct Session {
    child: Child,
    client: Client,
    /// The first event.
    begin: Value,
}

impl Session {
    /// Shows `s.toml` of the folder.
    fn start(folder: &Folder, options: &[&str]) -> Self {
        Session::start_with(folder, "s.toml", options)
    }

    /// Starts the command with more options, and connects.
    fn start_with(folder: &Folder, scenario: &str, options: &[&str]) -> Self {
        let arguments = [&["sim", scenario, "--view", "--no-browser"], options].concat();
        let mut command = folder.command(&arguments);
        let mut child = command.env("XDG_STATE_HOME", folder.path("state")).spawn().unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut url).unwrap();
        let mut client = Client::connect(url.trim());
        let begin = client.event("begin");
        Session { child, client, begin }
    }

    fn send(&mut self, request: Value) {
        self.client.send(request);
    }

    /// Sends a request and returns the next event of one of these kinds.
    fn ask(&mut self, request: Value, kinds: &[&str]) -> Value {
        self.send(request);
        loop {
            let event = self.client.next();
            if kinds.iter().any(|kind| event["event"] == *kind) {
                return event;
            }
        }
    }

    /// Returns the reason why a text of the scenario does not run.
    fn mistake(&mut self, scenario: &str) -> String {
        let request = json!({ "run": { "texts": { "s.toml": scenario } } });
        let event = self.ask(request, &["diagnostics", "began"]);
        if event["event"] == "began" {
            return "it runs".to_owned();
        }
        // The next event is that the session goes on.
        assert_eq!(self.client.next()["event"], "refused");
        event["diagnostics"][0]["message"].as_str().unwrap().to_owned()
    }

    fn write(&mut self, name: &str, text: &str, over: Option<&str>) -> Value {
        let request = json!({ "write": { "name": name, "text": text, "over": over } });
        self.ask(request, &["written", "changed", "refused"])
    }

    /// Returns the hash of the text in the file of a script.
    fn hash(&mut self, name: &str) -> String {
        let script = self.ask(json!({ "script": { "name": name } }), &["script"]);
        script["sha256"].as_str().unwrap().to_owned()
    }

    /// Waits until all requests were handled.
    fn settle(&mut self) {
        self.ask(json!("commands"), &["commands"]);
    }

    /// Ends the command as a crash does.
    fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // The command may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A folder with the scenario and its script.
fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.toml", SCENARIO);
    folder.write("s.bzz", SCRIPT);
    folder
}

/// The way from a stand-in for the browser to the page.
#[cfg(target_os = "linux")]
mod browser {
    use std::env;
    use std::path::PathBuf;
    use std::process::Command;
    use std::thread;
    use std::time::Instant;

    use super::*;

    /// Notes what it is given, and stays until the test removes `hold`.
    const PROGRAM: &str = "#!/bin/sh\ncd \"$NOTES\"\nprintf '%s' \"$1\" > path\nstat -c %a \"$1\" \"$(dirname \"$1\")\" > mode\ncp \"$1\" copy.html\n\
        : > noted\nwhile [ -e hold ]; do sleep 0.05; done\n";

    struct Browser {
        folder: Folder,
        child: Child,
        stdout: BufReader<std::process::ChildStdout>,
        /// The file that the browser got.
        redirect: PathBuf,
        url: String,
    }

    impl Browser {
        fn start(test: &str) -> Self {
            let folder = folder(test);
            fs::create_dir(folder.path("bin")).unwrap();
            fs::create_dir(folder.path("run")).unwrap();
            folder.program("bin/xdg-open", PROGRAM.as_bytes());
            folder.write("hold", "");
            let path = format!("{}:{}", folder.path("bin").display(), env::var("PATH").unwrap());
            let mut command = folder.command(&["sim", "s.toml", "--view"]);
            command.env("PATH", path).env("NOTES", folder.path("."));
            command.env("XDG_RUNTIME_DIR", folder.path("run"));
            let mut child = command.spawn().unwrap();
            let stdout = BufReader::new(child.stdout.take().unwrap());
            until(|| folder.path("noted").exists());
            let redirect = String::from_utf8(folder.read("path")).unwrap();
            let page = String::from_utf8(folder.read("copy.html")).unwrap();
            let url = page.split("url=").nth(1).unwrap().split('"').next().unwrap().to_owned();
            Browser { folder, child, stdout, redirect: redirect.into(), url }
        }

        fn end(mut self) {
            fs::remove_file(self.folder.path("hold")).unwrap();
            self.child.kill().unwrap();
            self.child.wait().unwrap();
        }
    }

    /// Waits until a condition holds.
    fn until(condition: impl Fn() -> bool) {
        let start = Instant::now();
        while !condition() {
            assert!(start.elapsed() < WAIT_MAX, "it does not become true");
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Returns the processes whose file of that name in /proc contains a text.
    fn processes_with(file: &str, text: &str) -> Vec<String> {
        let entries = fs::read_dir("/proc").unwrap().flatten();
        let names = entries.map(|entry| entry.path().join(file));
        // A process may end meanwhile, or belong to another user.
        let with = names.filter(|path| {
            fs::read(path).is_ok_and(|content| String::from_utf8_lossy(&content).contains(text))
        });
        with.map(|path| path.display().to_string()).collect()
    }

    #[test]
    fn the_address_is_in_no_list_of_processes() {
        let browser = Browser::start("view-secret");
        let secret = browser.url.trim_end_matches('/').rsplit('/').next().unwrap().to_owned();
        assert_eq!(secret.len(), 32, "{}", browser.url);
        // The name of the file is in the list, so the search would find the address, too. The
        // shell stands there twice while it starts another program.
        let name = browser.redirect.display().to_string();
        assert_ne!(processes_with("cmdline", &name), [""; 0], "{name}");
        assert_eq!(processes_with("cmdline", &secret), [""; 0]);
        assert_eq!(processes_with("environ", &secret), [""; 0]);
        let listed = Command::new("ps").args(["-eww", "-o", "args"]).output();
        if let Ok(listed) = listed {
            assert!(!String::from_utf8_lossy(&listed.stdout).contains(&secret));
        }
        assert_eq!(browser.folder.read("mode"), b"600\n700\n");
        assert!(browser.redirect.starts_with(browser.folder.path("run")), "{name}");
        // The file has served when the page is connected.
        let mut client = Client::connect(&browser.url);
        client.event("begin");
        until(|| !browser.redirect.exists());
        assert_eq!(fs::read_dir(browser.folder.path("run")).unwrap().count(), 0);
        browser.end();
    }

    #[test]
    fn the_address_of_a_page_that_no_browser_opens_is_printed() {
        let mut browser = Browser::start("view-printed");
        let mut line = String::new();
        browser.stdout.read_line(&mut line).unwrap();
        assert_eq!(line, format!("{}\n", browser.url));
        assert!(browser.redirect.exists(), "the browser may be slow");
        let signal = nix::sys::signal::Signal::SIGINT;
        let process = nix::unistd::Pid::from_raw(browser.child.id() as i32);
        nix::sys::signal::kill(process, signal).unwrap();
        until(|| !browser.redirect.exists());
        browser.end();
    }
}

/// A page can neither read nor write more than the files of the scenario that was opened.
#[test]
fn an_edited_scenario_reads_no_other_files() {
    let root = Folder::new("view-fence");
    for name in ["world", "world/sub", "other"] {
        fs::create_dir(root.path(name)).unwrap();
    }
    root.write("other/victim.bzz", "secret = 1\n");
    root.write("other/robot.toml", "name = \"secret\"\n");
    root.write("world/s.toml", SCENARIO.replace("s.bzz", "world.bzz"));
    root.write("world/world.bzz", SCRIPT);
    root.write("world/sub/part.bzz", "part = 1\n");
    #[cfg(unix)]
    for (target, link) in [("../other/victim.bzz", "link.bzz"), ("../other", "linked")] {
        std::os::unix::fs::symlink(target, root.path("world").join(link)).unwrap();
    }
    let mut session = Session::start_with(&root, "world/s.toml", &[]);
    let absolute = root.path("other/victim.bzz").display().to_string();
    let outside = "it is outside of the scenario's folder";
    let mut scripts = vec![
        "../other/victim.bzz",
        "sub/../../other/victim.bzz",
        "../other/missing.bzz",
        &absolute,
        "/etc/passwd",
    ];
    if cfg!(unix) {
        scripts.extend(["link.bzz", "linked/victim.bzz"]);
    }
    let text = SCENARIO.replace("s.bzz", "world.bzz");
    for script in &scripts {
        let mistake = session.mistake(&text.replace("world.bzz", script));
        assert!(mistake.contains(outside), "{script}: {mistake}");
        let event = format!("{text}[[event]]\nat = 1\nload = \"all\"\nscript = \"{script}\"\n");
        let mistake = session.mistake(&event);
        assert!(mistake.contains(outside), "{script}: {mistake}");
        let command =
            json!({ "command": { "text": format!("load = \"all\"\nscript = \"{script}\"") } });
        let refused = session.ask(command, &["refused", "conditions"]);
        assert!(refused["text"].as_str().unwrap().contains("outside"), "{script}: {refused}");
    }
    for robot in ["../other/robot.toml", "/etc/robot.toml"] {
        let mistake = session.mistake(&text.replace("kilobot", robot));
        assert!(mistake.contains(outside), "{robot}: {mistake}");
    }
    for include in ["/etc/passwd", "../other/victim.bzz", &absolute, "sub/../../other/victim.bzz"] {
        let script = format!("include \"{include}\"\n{SCRIPT}");
        let request = json!({ "check": { "name": "world.bzz", "text": script } });
        let event = session.ask(request, &["diagnostics"]);
        let found = &event["diagnostics"][0];
        assert!(found["help"].as_str().unwrap().contains(outside), "{include}: {event}");
        assert!(!event.to_string().contains("root:"), "{event}");
    }
    // Files of the folder and of the library can be included.
    let script = format!("include \"sub/part.bzz\"\ninclude \"vec2.bzz\"\n{SCRIPT}");
    let request = json!({ "check": { "name": "world.bzz", "text": script } });
    assert_eq!(session.ask(request, &["diagnostics"])["diagnostics"], json!([]));
}

#[test]
fn only_scripts_of_the_opened_scenario_are_written() {
    let folder = folder("view-write");
    folder.write("other.bzz", "# Of nobody.\n");
    let mut session = Session::start(&folder, &[]);
    assert_eq!(session.begin["scripts"]["writable"], json!(["s.bzz"]));
    for name in ["other.bzz", "S.bzz", "./s.bzz", "../s.bzz", "/etc/passwd", "s.toml", ""] {
        let refused = session.write(name, "# New.\n", None);
        assert_eq!(refused["text"], format!("no robot has the script `{name}`"));
    }
    // A scenario that is edited does not widen what can be written.
    assert_eq!(session.mistake(&SCENARIO.replace("s.bzz", "other.bzz")), "it runs");
    let refused = session.write("other.bzz", "# New.\n", None);
    let text = refused["text"].as_str().unwrap();
    assert!(text.contains("it was no script of the scenario when the session began"), "{text}");
    let embedded = format!("{SCENARIO}[[file]]\npath = \"s.bzz\"\ntext = \"# In it.\\n\"\n");
    assert_eq!(session.mistake(&embedded), "it runs");
    let refused = session.write("s.bzz", "# New.\n", None);
    assert!(refused["text"].as_str().unwrap().contains("stands in the scenario"), "{refused}");
    assert_eq!(session.mistake(SCENARIO), "it runs");
    // A link that is made later leads nowhere else.
    #[cfg(unix)]
    {
        fs::remove_file(folder.path("s.bzz")).unwrap();
        std::os::unix::fs::symlink("other.bzz", folder.path("s.bzz")).unwrap();
        let refused = session.write("s.bzz", "# New.\n", None);
        let text = refused["text"].as_str().unwrap();
        assert!(text.contains("its path leads to another file now"), "{text}");
        fs::remove_file(folder.path("s.bzz")).unwrap();
    }
    assert_eq!(folder.read("other.bzz"), b"# Of nobody.\n");
    assert_eq!(session.write("s.bzz", "# New.\n", None)["event"], "written");
    assert_eq!(folder.read("s.bzz"), b"# New.\n");
}

#[test]
fn a_file_that_changed_meanwhile_is_not_overwritten() {
    let folder = folder("view-changed");
    let mut session = Session::start(&folder, &[]);
    let first = session.hash("s.bzz");
    let written = session.write("s.bzz", "# One.\n", Some(&first));
    assert_eq!(written["event"], "written");
    let second = written["sha256"].as_str().unwrap().to_owned();
    assert_eq!(session.write("s.bzz", "# Two.\n", Some(&second))["event"], "written");
    // Another program writes the file.
    folder.write("s.bzz", "# Another.\n");
    let changed = session.write("s.bzz", "# Three.\n", Some(&second));
    assert_eq!((&changed["event"], &changed["saved"]), (&json!("changed"), &json!("# Another.\n")));
    assert_eq!(folder.read("s.bzz"), b"# Another.\n");
    let known = changed["sha256"].as_str().unwrap().to_owned();
    assert_eq!(session.write("s.bzz", "# Three.\n", Some(&known))["event"], "written");
    fs::remove_file(folder.path("s.bzz")).unwrap();
    let changed = session.write("s.bzz", "# Four.\n", Some(&known));
    assert_eq!((&changed["event"], &changed["saved"]), (&json!("changed"), &Value::Null));
    assert_eq!(session.write("s.bzz", "# Four.\n", None)["event"], "written");
    assert_eq!(folder.read("s.bzz"), b"# Four.\n");
}

#[test]
fn a_read_only_session_writes_nothing() {
    let folder = folder("view-read-only");
    let mut session = Session::start(&folder, &["--read-only"]);
    assert_eq!(session.begin["scripts"]["writable"], json!([]));
    let refused = session.write("s.bzz", "# New.\n", None);
    let text = refused["text"].as_str().unwrap();
    assert!(text.ends_with("s.bzz` is not written: the session is read-only"), "{text}");
    assert_eq!(folder.read("s.bzz"), SCRIPT.as_bytes());
    // The option of earlier versions says nothing any more.
    folder.bbz(&["sim", "s.toml", "--view", "--edit"]).fails_with(3, &["--edit"]);
}

#[test]
fn a_text_that_was_not_saved_survives_a_crash() {
    let folder = folder("view-unsaved");
    let mut session = Session::start(&folder, &[]);
    assert_eq!(session.begin["scripts"]["unsaved"], json!([]));
    let over = session.hash("s.bzz");
    for text in ["# Some.\n", "# Some words.\n"] {
        session.send(json!({ "unsaved": { "name": "s.bzz", "text": text, "over": over } }));
    }
    let scenario =
        json!({ "name": "s.toml", "text": "# A world.\n", "over": session.hash("s.toml") });
    session.send(json!({ "unsaved": scenario }));
    session.settle();
    session.kill();
    // The next session names the scenario by another path.
    let again = folder.path("s.toml").display().to_string();
    let offered = |folder: &Folder| -> Vec<Value> {
        let session = Session::start_with(folder, &again, &[]);
        session.begin["scripts"]["unsaved"].as_array().unwrap().clone()
    };
    let found = offered(&folder);
    let texts: Vec<_> =
        found.iter().map(|one| (&one["name"], &one["text"], &one["changed"])).collect();
    assert_eq!(
        texts,
        [
            (&json!("s.bzz"), &json!("# Some words.\n"), &json!(false)),
            (&json!("s.toml"), &json!("# A world.\n"), &json!(false)),
        ]
    );
    let year_2020 = 1_577_836_800;
    assert!(found[0]["seconds"].as_u64().unwrap() > year_2020);
    folder.write("s.bzz", "# Another.\n");
    assert_eq!(offered(&folder)[0]["changed"], json!(true));
    // A text that the file has got meanwhile is not offered.
    folder.write("s.bzz", "# Some words.\n");
    assert_eq!(offered(&folder).len(), 1);
    let mut session = Session::start(&folder, &[]);
    let id = session.begin["scripts"]["unsaved"][0]["id"].clone();
    session.send(json!({ "discard": { "id": id } }));
    session.settle();
    drop(session);
    assert_eq!(Session::start(&folder, &[]).begin["scripts"]["unsaved"], json!([]));
}

#[test]
fn a_saved_session_replays_from_another_folder() {
    let folder = Folder::new("view-saved");
    for name in ["world", "world/parts", "world/robots", "shared", "lib"] {
        fs::create_dir(folder.path(name)).unwrap();
    }
    folder.write(
        "world/robots/rover.toml",
        "name = \"rover\"\n\n[body]\nradius_mm = 30\ndrive = \"differential\"\nwheel_distance_mm = 40\nspeed_mm_s = 100\n\n\
         [[function]]\nname = \"wheels\"\naccepts = [\"left: number, right: number\"]\n\
         sets = { left_wheel = \"left mm/s\", right_wheel = \"right mm/s\" }\nhelp = \"Drives.\"\n",
    );
    folder.write("world/parts/speed.bzz", "speed = 40\n");
    folder.write("lib/turn.bzz", "turn = 5\n");
    folder.write(
        "shared/drive.bzz",
        "include \"../world/parts/speed.bzz\"\ninclude \"turn.bzz\"\ninclude \"vec2.bzz\"\n\
         log(\"it's '''\")\nfunction step() { wheels(speed, turn) }\n",
    );
    folder.write("world/walk.bzz", "function step() { set_motor(60, 80) }\n");
    folder.write(
        "world/s.toml",
        "[world]\nsize = [2000, 2000]\nduration = 20\n\n\
         [[robots]]\nrobot = \"robots/rover.toml\"\nscript = \"../shared/drive.bzz\"\ncount = 3\n\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = 2\nat = [0, 500]\narea = [800, 400]\n",
    );
    let lib = folder.path("lib").display().to_string();
    let world = folder.path("world").display().to_string();
    let mut session = Session::start_with(&folder, &format!("{world}/s.toml"), &["-I", &lib]);
    session.ask(json!({ "go_to": { "tick": 50 } }), &["state"]);
    let draft = "function step() { set_motor(90, 10) }\n";
    session.ask(json!({ "load": { "name": "walk.bzz", "text": draft, "robots": [3] } }), &["ran"]);
    // Files that change later do not change the session.
    folder.write("world/parts/speed.bzz", "speed = 10\n");
    assert_eq!(session.write("walk.bzz", "# Saved.\n", None)["event"], "written");
    session.ask(json!({ "command": { "text": "move = 0\nto = [100, 100]" } }), &["conditions"]);
    while session.ask(json!({ "go_to": { "tick": 200 } }), &["state"])["tick"] != 200 {}
    let digest = session.ask(json!("digest"), &["digest"])["digest"].clone();
    let saved = session.ask(json!("scenario"), &["scenario"]);
    assert_eq!(saved["missing"], json!([]));
    let text = saved["text"].as_str().unwrap();
    assert_eq!(text.matches("[[file]]").count(), 6, "{text}");
    let other = Folder::with("view-saved-elsewhere", "session.toml", text);
    let replayed = other.digest_of("session.toml");
    assert_eq!(replayed, digest, "{text}");
    // The saved session can be shown, changed and saved again.
    let mut session = Session::start_with(&other, "session.toml", &[]);
    assert_eq!(session.begin["scripts"]["writable"], json!([]));
    let script = session.ask(json!({ "script": { "name": "walk.1.bzz" } }), &["script"]);
    assert_eq!(script["text"], draft);
    let ran = session.ask(
        json!({ "load": { "name": "walk.bzz", "text": "function step() { led(1) }\n" } }),
        &["ran"],
    );
    assert_eq!(ran["draft"], "walk.2.bzz");
    while session.ask(json!({ "go_to": { "tick": 200 } }), &["state"])["tick"] != 200 {}
    let digest = session.ask(json!("digest"), &["digest"])["digest"].clone();
    let saved = session.ask(json!("scenario"), &["scenario"]);
    let text = saved["text"].as_str().unwrap();
    assert_eq!(text.matches("[[file]]").count(), 7, "{text}");
    let third = Folder::with("view-saved-again", "session.toml", text);
    assert_eq!(third.digest_of("session.toml"), digest, "{text}");
}

impl Folder {
    /// Returns the digest of a scenario's run.
    fn digest_of(&self, scenario: &str) -> Value {
        let outcome = self.bbz(&["sim", scenario, "--json"]);
        let object: Value = serde_json::from_str(&outcome.stdout).expect(&outcome.stderr);
        object["digest"].clone()
    }
}
