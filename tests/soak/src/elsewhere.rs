//! The programs of a release on other systems than this one: they print, simulate and serve the same.
//!
//! The programs are built as they are downloaded ([`bittybuzz_builds::programs`]). Wine runs those for Windows, and QEMU's
//! emulation of a processor those for 64-bit ARM.

use crate::Verdict;
use anyhow::{Context, Result, ensure};
use bittybuzz_builds::programs::{LINUX_ARM, Platform, WINDOWS, WINE, build_own_bbz};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::{Invocation, root, target};
use fs_err as fs;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Path prefixes of the files that the evidence is about.
pub const MADE_OF: &[&str] = &[
    "Cargo",
    "arena/",
    "bbz/",
    "comms/",
    "compiler/",
    "examples/",
    "flight/",
    "inspect/",
    "lib/",
    "live/",
    "robots/",
    "spec/",
    "tests/soak/src/bcryptprimitives.c",
    "tests/soak/src/elsewhere.rs",
    "tools/builds/",
    "vm-core/",
];

/// The source of a library of Windows that Wine 8.0 does not have, from the root.
const RANDOM: &str = "tests/soak/src/bcryptprimitives.c";

/// Folders of scripts whose messages and images are compared.
const SCRIPTS: [&str; 3] = ["examples/errors", "examples/swarm", "examples/kilobot"];

/// Scenarios whose digests are compared: all links, flight in the physics, light, obstacles, and files
/// in other folders. Emulated robots would need images and the emulators of the platform.
const SCENARIOS: [&str; 12] = [
    "examples/flight/hover.toml",
    "examples/flight/swap.toml",
    "examples/ground/line.toml",
    "examples/kilobot/gradient.toml",
    "examples/lessons/lamp.toml",
    "examples/patrol.toml",
    "examples/random_walk.toml",
    "examples/swarm/aggregation.toml",
    "examples/swarm/flocking.toml",
    "examples/swarm/herding.toml",
    "examples/swarm/particle_swarm.toml",
    "examples/swarm/wind.toml",
];

/// The item of the scripts.
const CHECK: &str = "check";
/// The item of the page.
const PAGE: &str = "page";

/// The scenario that the page shows.
const SHOWN: &str = "examples/swarm/gradient.toml";

/// Files of the page, with their names in its address.
const FILES: [(&str, &str); 3] =
    [("index.html", ""), ("main.js", "main.js"), ("style.css", "style.css")];

/// The longest wait for an answer of the page, which takes less than a second otherwise.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// Returns the items for Windows.
pub fn windows_items() -> Vec<String> {
    [CHECK].into_iter().chain(SCENARIOS).chain([PAGE]).map(str::to_owned).collect()
}

/// Returns the items for Linux on 64-bit ARM, where the page has the same code as on this computer.
pub fn arm_items() -> Vec<String> {
    [CHECK].into_iter().chain(SCENARIOS).map(str::to_owned).collect()
}

/// Compares the program for Windows with that of this computer.
pub fn run_windows(item: &str) -> Result<Verdict> {
    setup::wine()?;
    let prefix = target()?.join("soak/windows/wine");
    let foreign = Foreign {
        platform: &WINDOWS,
        // Without messages of Wine about its own state.
        variables: vec![
            ("WINEPREFIX", prefix.display().to_string()),
            ("WINEDEBUG", "-all".to_owned()),
        ],
    };
    if !prefix.is_dir() {
        fs::create_dir_all(prefix.parent().context("the folder is in another")?)?;
        foreign.with_variables(Invocation::new(WINE, &["wineboot", "--init"])).output(0)?;
    }
    let library = prefix.join("drive_c/windows/system32/bcryptprimitives.dll");
    if !library.is_file() {
        setup::mingw()?;
        let output = library.display().to_string();
        let arguments = ["-shared", "-O2", "-o", &output, RANDOM, "-ladvapi32"];
        Invocation::new("x86_64-w64-mingw32-gcc", &arguments).run()?;
    }
    foreign.compare(item)
}

/// Compares the program for 64-bit ARM with that of this computer.
pub fn run_arm(item: &str) -> Result<Verdict> {
    setup::qemu_user()?;
    Foreign { platform: &LINUX_ARM, variables: Vec::new() }.compare(item)
}

/// A platform, and the environment of its programs.
struct Foreign {
    platform: &'static Platform,
    variables: Vec<(&'static str, String)>,
}

impl Foreign {
    fn with_variables(&self, line: Invocation) -> Invocation {
        self.variables.iter().fold(line, |line, (name, value)| line.env(name, value))
    }

    fn compare(&self, item: &str) -> Result<Verdict> {
        let foreign = self.platform.build_bbz()?;
        let native = build_own_bbz()?;
        match item {
            CHECK => self.compare_messages(&foreign, &native),
            PAGE => self.fetch_page(&foreign),
            scenario => self.compare_digests(&foreign, &native, scenario),
        }
    }

    /// Runs the program for the platform.
    fn run(&self, program: &Path, arguments: &[&str]) -> Result<Printed> {
        let words = self.platform.command(program);
        let (runner, rest) = words.split_first().context("a command has a first word")?;
        let rest: Vec<&str> = rest.iter().map(String::as_str).collect();
        Printed::by(self.with_variables(Invocation::new(runner, &[&rest[..], arguments].concat())))
    }

    /// Checks all scripts of the examples.
    fn compare_messages(&self, foreign: &Path, native: &Path) -> Result<Verdict> {
        let scripts = scripts()?;
        for script in &scripts {
            let arguments = ["check", script];
            let found = self.run(foreign, &arguments)?;
            let expected = Printed::by(Invocation::named("bbz", native, &arguments))?;
            if found != expected {
                return Ok(Verdict::Missing(format!(
                    "{script}: {found:?} instead of {expected:?}"
                )));
            }
        }
        Ok(Verdict::Shown(format!("{} scripts have the same messages", scripts.len())))
    }

    /// Simulates a scenario.
    fn compare_digests(&self, foreign: &Path, native: &Path, scenario: &str) -> Result<Verdict> {
        let arguments = ["sim", scenario, "--headless", "--json"];
        let found = digest(&self.run(foreign, &arguments)?)?;
        let expected = digest(&Printed::by(Invocation::named("bbz", native, &arguments))?)?;
        Ok(match found == expected {
            true => Verdict::Shown(format!("digest {found} on both")),
            false => Verdict::Missing(format!("digest {found} instead of {expected}")),
        })
    }

    /// Shows a scenario in a page, and fetches the page as a browser does.
    fn fetch_page(&self, foreign: &Path) -> Result<Verdict> {
        let words = self.platform.command(foreign);
        let (runner, rest) = words.split_first().context("a command has a first word")?;
        let mut command = Command::new(runner);
        command.args(rest).args(["sim", SHOWN, "--view", "--no-browser"]).current_dir(root());
        command.envs(self.variables.iter().map(|(name, value)| (name, value)));
        let mut server = Server(command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?);
        let mut address = String::new();
        let stdout = server.0.stdout.take().context("the output is a pipe")?;
        BufReader::new(stdout).read_line(&mut address)?;
        let address = address.trim();
        let rest = address.strip_prefix("http://").and_then(|rest| rest.split_once('/'));
        let Some((host, folder)) = rest else {
            return Ok(Verdict::Missing(format!("the address of the page is `{address}`")));
        };
        for (file, name) in FILES {
            let expected = fs::read(root().join("bbz/page/web").join(file))?;
            let (head, body) = get(host, &format!("/{folder}{name}"), "", None)?;
            if !head.starts_with("HTTP/1.1 200 ") || body != expected {
                return Ok(Verdict::Missing(format!("{file}: {head}, {} bytes", body.len())));
            }
        }
        // The page gets the run through this connection.
        let upgrade = "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                       Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
        let begin = Some(r#""event":"begin""#);
        let (head, _) = get(host, &format!("/{folder}socket"), upgrade, begin)?;
        Ok(match head.starts_with("HTTP/1.1 101 ") {
            true => Verdict::Shown(format!("{} files of the page, and its run", FILES.len())),
            false => Verdict::Missing(format!("the connection of the page: {head}")),
        })
    }
}

/// The outcome of a program. Paths have the separators of this system.
#[derive(Debug, PartialEq, Eq)]
struct Printed {
    status: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Printed {
    fn by(line: Invocation) -> Result<Printed> {
        let output = line.unannounced().output_if(|_| true)?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace('\\', "/");
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        Ok(Printed { status: output.status.code(), stdout, stderr })
    }
}

/// Returns the digest that `bbz sim --json` printed.
fn digest(printed: &Printed) -> Result<String> {
    let result: Value = serde_json::from_str(&printed.stdout)
        .with_context(|| format!("`bbz sim --json` printed {printed:?}"))?;
    Ok(result["digest"].as_str().context("the result has a digest")?.to_owned())
}

/// Returns the scripts of the examples, from the root.
fn scripts() -> Result<Vec<String>> {
    let mut scripts = Vec::new();
    for folder in SCRIPTS {
        for entry in fs::read_dir(root().join(folder))? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            if name.ends_with(".bzz") {
                scripts.push(format!("{folder}/{name}"));
            }
        }
    }
    ensure!(scripts.len() > 20, "{} scripts", scripts.len());
    scripts.sort();
    Ok(scripts)
}

/// Sends a request to a server, and returns the first line of the answer and its content. With `end`
/// the connection is upgraded, and the content is all that comes up to these characters.
fn get(host: &str, path: &str, headers: &str, end: Option<&str>) -> Result<(String, Vec<u8>)> {
    let mut stream = TcpStream::connect(host)?;
    stream.set_read_timeout(Some(WAIT_MAX))?;
    let connection = if end.is_some() { "Upgrade" } else { "close" };
    write!(
        stream,
        "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: {connection}\r\n{headers}\r\n"
    )?;
    let mut answer = BufReader::new(stream);
    let mut first = String::new();
    answer.read_line(&mut first)?;
    let mut line = first.clone();
    while line.trim_end() != "" {
        line.clear();
        answer.read_line(&mut line)?;
    }
    let mut content = Vec::new();
    match end {
        None => {
            answer.read_to_end(&mut content)?;
        }
        Some(end) => {
            while !String::from_utf8_lossy(&content).contains(end) {
                let more = answer.fill_buf()?.to_vec();
                ensure!(!more.is_empty(), "{path} ends without {end}");
                answer.consume(more.len());
                content.extend(more);
            }
        }
    }
    Ok((first.trim_end().to_owned(), content))
}

/// A running program, which ends with this value.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;
    use std::thread;

    #[test]
    fn items_are_files_of_the_repository() {
        let items = windows_items();
        assert!(items.iter().any(|item| item == PAGE) && !arm_items().contains(&PAGE.to_owned()));
        for scenario in SCENARIOS.into_iter().chain([SHOWN]) {
            let text = fs::read_to_string(root().join(scenario)).unwrap();
            assert!(!text.contains("\nbackend = "), "{scenario}");
        }
        for (file, _) in FILES {
            assert!(root().join("bbz/page/web").join(file).is_file(), "{file}");
        }
        assert!(scripts().unwrap().contains(&"examples/errors/misspelt_name.bzz".to_owned()));
    }

    #[test]
    fn digests_are_read() {
        let printed = |stdout: &str| Printed {
            status: Some(0),
            stdout: stdout.to_owned(),
            stderr: String::new(),
        };
        assert_eq!(digest(&printed(r#"{"digest":"0a","robots":[]}"#)).unwrap(), "0a");
        assert!(digest(&printed("{}")).is_err() && digest(&printed("")).is_err());
    }

    #[test]
    fn answers_are_read_to_their_end() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let host = listener.local_addr().unwrap().to_string();
        let server = thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut request = [0; 512];
            let count = stream.read(&mut request).unwrap();
            stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\n\r\na\r\nb").unwrap();
            String::from_utf8(request[..count].to_vec()).unwrap()
        });
        let (head, body) = get(&host, "/x/", "", None).unwrap();
        assert_eq!((head.as_str(), body.as_slice()), ("HTTP/1.1 200 OK", &b"a\r\nb"[..]));
        let request = server.join().unwrap();
        assert_eq!(
            request,
            format!("GET /x/ HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
        );
    }
}
