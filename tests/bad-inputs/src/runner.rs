//! Carries out calls.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bittybuzz_random::Random;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

use crate::bases::Bases;
use crate::case::{Case, Special, Streams};
use crate::judge::{Outcome, Report, Snapshot, broken};
use crate::kinds::Kind;

/// The limits of every call, as arguments of `ulimit`: seconds of processor time, KiB of address
/// space, and no files of memory after an abort.
const LIMITS: [&str; 3] = ["-t 10", "-v 1048576", "-c 0"];

/// The time after which a call counts as hanging. It is far above the limit of processor time,
/// because other programs may take the processors.
const PATIENCE: Duration = Duration::from_secs(90);

/// The time that a page is given to show something wrong before it is asked to end.
const PAGE: Duration = Duration::from_millis(50);

/// The most bytes of an output that are kept; more are read and discarded.
const KEPT_MAX: usize = 8 << 20;

/// The rules that `bbz` broke with an input.
#[derive(Debug)]
pub struct BrokenRules {
    pub kind: &'static str,
    pub seed: u64,
    pub rules: Vec<String>,
    /// The folder with the input as it was before the call, and the command.
    pub kept: PathBuf,
}

/// Runs inputs, one after the other.
pub struct Runner {
    bbz: PathBuf,
    /// The folder of the current call. Its path stays the same, because the journal of a sweep
    /// knows the paths of its files.
    folder: PathBuf,
    /// The folder for inputs with which rules were broken.
    kept: PathBuf,
    bases: Bases,
    /// Removes the folder of the calls at the end.
    _work: TempDir,
}

impl Runner {
    /// Makes valid files with that `bbz`, from which inputs are made. Inputs that break a rule are
    /// kept in `kept`. `root` is the folder of the repository.
    pub fn new(bbz: &Path, root: &Path, kept: &Path) -> io::Result<Self> {
        let work = tempfile::tempdir()?;
        // A link in the path would give two names to the files in a journal.
        let folder = fs::canonicalize(work.path())?.join("case");
        fs::create_dir(&folder)?;
        let bases = Bases::new(bbz, root, &folder)?;
        let (bbz, kept) = (bbz.to_owned(), kept.to_owned());
        Ok(Runner { bbz, folder, kept, bases, _work: work })
    }

    /// Runs one input.
    pub fn run(&self, kind: &Kind, seed: u64) -> io::Result<Option<BrokenRules>> {
        let mut random = Random::for_item(seed, kind.number());
        let case = (kind.make)(&self.bases, &mut random, seed);
        self.lay_out(&case, &self.folder)?;
        let before = snapshot(&self.folder)?;
        let outcome = self.call(&case)?;
        let after = snapshot(&self.folder)?;
        let report = match case.streams {
            Streams::Redirected(_) => Report::Elsewhere,
            Streams::Piped if case.arguments.iter().any(|word| word == "--json") => Report::Object,
            Streams::Piped => Report::Messages,
        };
        let rules = broken(&outcome, report, [&before, &after], &case.outputs);
        if rules.is_empty() {
            return Ok(None);
        }
        let kept = self.kept.join(format!("{}-{seed}", kind.name));
        self.keep(&case, &outcome, &rules, &kept)?;
        Ok(Some(BrokenRules { kind: kind.name, seed, rules, kept }))
    }

    /// Makes the files of a case in an empty folder.
    fn lay_out(&self, case: &Case, folder: &Path) -> io::Result<()> {
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
        fs::create_dir_all(folder)?;
        for (name, content) in &case.files {
            let path = folder.join(name);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            fs::write(path, content)?;
        }
        for (name, special) in &case.special {
            let path = folder.join(name);
            match special {
                Special::Folder => fs::create_dir(path)?,
                Special::Pipe => nix::unistd::mkfifo(&path, nix::sys::stat::Mode::S_IRWXU)?,
                // The file stays when the listener is closed.
                Special::Socket => drop(UnixListener::bind(path)?),
                Special::Link(target) => symlink(target, path)?,
            }
        }
        Ok(())
    }

    fn call(&self, case: &Case) -> io::Result<Outcome> {
        let mut command = self.command(case);
        let mut child = command.spawn()?;
        let mut stdin = child.stdin.take();
        let input = case.stdin.clone();
        // A process that ends early closes the pipe.
        let writer = thread::spawn(move || stdin.as_mut().map(|pipe| pipe.write_all(&input)));
        let (seen, first) = mpsc::channel();
        let stdout = child.stdout.take().map(|pipe| read_aside(pipe, Some(seen)));
        let stderr = child.stderr.take().map(|pipe| read_aside(pipe, None));
        let shows_page = case.arguments.iter().any(|word| word == "view" || word == "--view");
        let mut outcome = wait(&mut child, shows_page.then_some(&first))?;
        let bytes = |reader: Option<JoinHandle<Vec<u8>>>| {
            reader.map_or(Vec::new(), |reader| reader.join().expect("a reader does not panic"))
        };
        (outcome.stdout, outcome.stderr) = (bytes(stdout), bytes(stderr));
        drop(writer.join());
        Ok(outcome)
    }

    /// Returns the call in a shell, which sets the limits and the streams.
    fn command(&self, case: &Case) -> Command {
        // A name without a folder would be searched in the PATH of the case.
        let mut command = Command::new("/bin/sh");
        command.arg("-c").arg(script(case)).arg("sh").arg(&self.bbz).args(&case.arguments);
        command
            .current_dir(&self.folder)
            .env_remove("BUZZ_INCLUDE_PATH")
            .env_remove("CLICOLOR_FORCE")
            .env("RUST_BACKTRACE", "0")
            .env("HOME", &self.folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        for (name, value) in &case.variables {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        command
    }

    /// Keeps an input for repetition.
    fn keep(
        &self,
        case: &Case,
        outcome: &Outcome,
        rules: &[String],
        kept: &Path,
    ) -> io::Result<()> {
        if kept.exists() {
            fs::remove_dir_all(kept)?;
        }
        self.lay_out(case, &kept.join("case"))?;
        let script = script(case);
        let mut line = format!("sh -c {} sh {}", quoted(script.as_ref()), self.bbz.display());
        for word in &case.arguments {
            line += " ";
            line += &quoted(word);
        }
        fs::write(kept.join("command"), format!("{line} <../stdin\n"))?;
        fs::write(kept.join("rules"), rules.join("\n") + "\n")?;
        fs::write(kept.join("stdin"), &case.stdin)?;
        fs::write(kept.join("stdout"), &outcome.stdout)?;
        fs::write(kept.join("stderr"), &outcome.stderr)
    }
}

/// Returns the script of the shell that starts `bbz` with the limits and streams of a case.
fn script(case: &Case) -> String {
    let limits = LIMITS.into_iter().chain(case.limits.iter().map(String::as_str));
    let limits: String = limits.map(|limit| format!("ulimit {limit}; ")).collect();
    let streams = match case.streams {
        Streams::Piped => "",
        Streams::Redirected(streams) => streams,
    };
    format!("{limits}exec \"$@\" {streams}")
}

fn quoted(word: &OsStr) -> String {
    format!("'{}'", word.to_string_lossy().replace('\'', r"'\''"))
}

/// Waits for the end of a process. One that shows a page is asked to end once it has printed the
/// address.
fn wait(child: &mut Child, page: Option<&Receiver<()>>) -> io::Result<Outcome> {
    let start = Instant::now();
    let mut asked = false;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Outcome { status: status.code(), ..Outcome::default() });
        }
        if !asked && page.is_some_and(|first| first.try_recv().is_ok()) {
            thread::sleep(PAGE);
            let id = i32::try_from(child.id()).expect("process ids of Unix are signed");
            kill(Pid::from_raw(id), Signal::SIGINT)?;
            asked = true;
        }
        if start.elapsed() > PATIENCE {
            child.kill()?;
            child.wait()?;
            return Ok(Outcome { hangs: true, ..Outcome::default() });
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// Reads a stream to its end, and announces its first bytes.
fn read_aside(
    mut pipe: impl Read + Send + 'static,
    first: Option<mpsc::Sender<()>>,
) -> JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let (mut bytes, mut buffer) = (Vec::new(), vec![0; 1 << 16]);
        while let Ok(count @ 1..) = pipe.read(&mut buffer) {
            if bytes.len() < KEPT_MAX {
                bytes.extend_from_slice(&buffer[..count]);
            }
            if let Some(first) = &first {
                // The receiver is gone if the command shows no page.
                let _ = first.send(());
            }
        }
        bytes
    })
}

/// Returns the files below a folder. Special files are not opened.
fn snapshot(folder: &Path) -> io::Result<Snapshot> {
    let mut files = Snapshot::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next)? {
            let path = entry?.path();
            let kind = fs::symlink_metadata(&path)?.file_type();
            if kind.is_dir() {
                folders.push(path.clone());
            }
            let content = match kind.is_file() {
                true => fs::read(&path)?,
                false => format!("{kind:?}").into_bytes(),
            };
            let name = path.strip_prefix(folder).expect("the walk starts at the folder");
            files.insert(name.to_owned(), content);
        }
    }
    Ok(files)
}
