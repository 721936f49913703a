//! The rules of `.github/workflows`: a job that may write runs no code of this repository or of its
//! dependencies, so that a bad dependency cannot publish anything.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use bittybuzz_builds::programs::PLATFORMS;
use serde_json::Value;

/// The actions of jobs that may write. They run no code of this repository.
const HARMLESS_ACTIONS: &[&str] =
    &["actions/download-artifact", "actions/attest-build-provenance", "actions/deploy-pages"];

/// The programs of jobs that may write.
const HARMLESS_PROGRAMS: &[&str] = &["cat", "cd", "gh", "sha256sum"];

/// The workflow whose success a release needs.
const CI: &str = "./.github/workflows/ci.yml";

/// Returns the workflows by file name.
fn workflows() -> BTreeMap<String, Value> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let entries = fs::read_dir(root.join(".github/workflows")).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .map(|path| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, parse(&fs::read_to_string(&path).unwrap()))
        })
        .collect()
}

fn parse(text: &str) -> Value {
    yaml_serde::from_str(text).unwrap()
}

fn jobs(workflow: &Value) -> impl Iterator<Item = (&String, &Value)> {
    workflow["jobs"].as_object().unwrap().iter()
}

fn steps(job: &Value) -> &[Value] {
    job["steps"].as_array().map_or(&[], Vec::as_slice)
}

/// Returns the actions and workflows that a job uses.
fn uses(job: &Value) -> impl Iterator<Item = &str> {
    [job].into_iter().chain(steps(job)).filter_map(|part| part["uses"].as_str())
}

/// Returns the first word of each command in the steps of a job.
fn programs(job: &Value) -> impl Iterator<Item = &str> {
    let lines = steps(job).iter().filter_map(|step| step["run"].as_str()).flat_map(str::lines);
    let commands = lines.flat_map(|line| line.split(['|', ';', '&', '(', '`']));
    commands.filter_map(|command| command.split_whitespace().next())
}

/// Returns true for a job that may change something outside of its own machine.
fn may_write(job: &Value) -> bool {
    let permissions = &job["permissions"];
    let writes = |value: &Value| value.as_str().is_some_and(|level| level.starts_with("write"));
    let text = job.to_string();
    writes(permissions)
        || permissions.as_object().is_some_and(|each| each.values().any(writes))
        || !job["environment"].is_null()
        || ["secrets", "github.token"].iter().any(|word| text.contains(word))
}

/// Returns the jobs that a job waits for, directly or through others.
fn waits_for(workflow: &Value, job: &Value) -> BTreeSet<String> {
    let direct: Vec<&str> = match &job["needs"] {
        Value::String(name) => vec![name],
        names => names.as_array().into_iter().flatten().filter_map(Value::as_str).collect(),
    };
    let further = direct.iter().flat_map(|name| waits_for(workflow, &workflow["jobs"][*name]));
    direct.iter().map(|name| (*name).to_owned()).chain(further).collect()
}

/// Returns the rules that a workflow breaks.
fn broken(workflow: &Value) -> Vec<String> {
    let mut broken = Vec::new();
    if workflow["permissions"].as_object().is_none_or(|given| !given.is_empty()) {
        broken.push("the workflow needs `permissions: {}`".to_owned());
    }
    for (name, job) in jobs(workflow) {
        let mut report = |rule: &str| broken.push(format!("{name}: {rule}"));
        if !job["permissions"].is_object() {
            report("no permissions of its own");
        }
        // A job that calls a workflow has the limits of its jobs.
        if job["uses"].is_null() && !job["timeout-minutes"].is_u64() {
            report("no time limit");
        }
        for action in uses(job).filter(|action| !action.starts_with("./.github/workflows/")) {
            let is_pinned = action.split_once('@').is_some_and(|(_, commit)| {
                commit.len() == 40 && commit.bytes().all(|digit| digit.is_ascii_hexdigit())
            });
            if !is_pinned {
                report(&format!("{action} is not pinned by a commit"));
            }
        }
        for step in steps(job).iter().filter(|step| {
            step["uses"].as_str().is_some_and(|action| action.starts_with("actions/checkout@"))
        }) {
            if step["with"]["persist-credentials"] != false {
                report("a checkout leaves its token in the folder");
            }
        }
        if !may_write(job) {
            continue;
        }
        for action in uses(job) {
            if !HARMLESS_ACTIONS.contains(&action.split('@').next().unwrap()) {
                report(&format!("may write, and uses {action}"));
            }
        }
        for program in programs(job) {
            if !HARMLESS_PROGRAMS.contains(&program) {
                report(&format!("may write, and runs {program}"));
            }
        }
    }
    broken
}

#[test]
fn all_workflows_follow_the_rules() {
    let workflows = workflows();
    assert!(["ci.yml", "release.yml"].iter().all(|name| workflows.contains_key(*name)));
    let broken: Vec<_> =
        workflows.iter().map(|(name, workflow)| (name, broken(workflow))).collect();
    assert!(broken.iter().all(|(_, rules)| rules.is_empty()), "{broken:#?}");
}

#[test]
fn a_release_waits_for_ci_of_its_commit() {
    let workflows = workflows();
    assert!(workflows["ci.yml"]["on"].as_object().unwrap().contains_key("workflow_call"));
    let release = &workflows["release.yml"];
    let writing: Vec<_> = jobs(release).filter(|(_, job)| may_write(job)).collect();
    assert!(!writing.is_empty());
    for (name, job) in writing {
        assert_eq!(job["environment"], "release", "{name}");
        // A condition such as `always()` would not wait for success.
        assert!(job["if"].is_null(), "{name}");
        let before = waits_for(release, job);
        assert!(
            before.iter().any(|name| release["jobs"][name]["uses"] == CI),
            "{name}: {before:?}"
        );
    }
}

/// Returns the values of a key in the matrix of a job, which are a list or in `include`.
fn matrix<'a>(job: &'a Value, key: &str) -> BTreeSet<&'a str> {
    let matrix = &job["strategy"]["matrix"];
    let listed = matrix[key].as_array().into_iter().flatten();
    let included = matrix["include"].as_array().into_iter().flatten().map(|entry| &entry[key]);
    listed.chain(included).filter_map(Value::as_str).collect()
}

/// Programs that this project builds on one system for others have started on their own system, and the
/// tutorial works on systems that CI does not have.
#[test]
fn a_release_waits_until_its_archives_have_started() {
    let workflows = workflows();
    let release = &workflows["release.yml"];
    let jobs = &release["jobs"];
    let before = waits_for(release, &jobs["publish"]);
    let needed = ["programs", "programs-of-macos", "start", "tutorial"];
    assert!(needed.into_iter().all(|name| before.contains(name)), "{before:?}");
    for packing in ["programs", "programs-of-macos"] {
        assert_eq!(matrix(&jobs[packing], "part"), BTreeSet::from(["tools", "wheel"]), "{packing}");
    }
    let packed: BTreeSet<&str> = PLATFORMS.iter().map(|platform| platform.target).collect();
    assert_eq!(matrix(&jobs["programs"], "target"), packed);
    let others = BTreeSet::from(["aarch64-apple-darwin"]);
    assert_eq!(matrix(&jobs["start"], "target"), &packed | &others);
    let systems = matrix(&jobs["tutorial"], "os");
    let has = |name: &str| systems.iter().any(|system| system.starts_with(name));
    assert!(has("macos") && has("windows"), "{systems:?}");
}

/// The archives that are published are those whose origin is attested: one job does both.
#[test]
fn published_archives_are_attested() {
    let workflows = workflows();
    let publishing: Vec<_> = jobs(&workflows["release.yml"])
        .filter(|(_, job)| job.to_string().contains("gh release create"))
        .collect();
    let [(_, job)] = publishing[..] else { panic!("{publishing:?}") };
    assert!(uses(job).any(|action| action.starts_with("actions/attest-build-provenance@")));
}

#[test]
fn advisories_are_read_each_week() {
    let workflows = workflows();
    let reading: Vec<_> = workflows
        .values()
        .flat_map(|workflow| jobs(workflow).map(move |(_, job)| (workflow, job)))
        .filter(|(_, job)| job.to_string().contains("check advisories"))
        .collect();
    let [(workflow, job)] = reading[..] else { panic!("{reading:?}") };
    let times = workflow["on"]["schedule"].as_array().unwrap();
    // Minute, hour, day of the month, month, day of the week.
    let is_weekly = |cron: &str| cron.split(' ').skip(2).eq(["*", "*", "1"]);
    assert!(times.iter().any(|time| time["cron"].as_str().is_some_and(is_weekly)), "{times:?}");
    assert!(workflow["on"].as_object().unwrap().contains_key("push"));
    assert!(job["continue-on-error"].is_null(), "a failure looks like a success");
}

#[test]
fn mistakes_in_workflows_are_found() {
    let workflow = parse(
        "permissions: { contents: write }\n\
         jobs:\n  \
           a:\n    steps: [{ uses: actions/checkout@v4 }, { run: cargo test }]\n  \
           b:\n    permissions: { contents: write }\n    timeout-minutes: 5\n    steps:\n      \
             - run: |\n          cd x && ./run.sh\n          echo \"$(cargo xtask)\"\n  \
           c:\n    permissions: {}\n    timeout-minutes: 5\n    environment: release\n    \
             steps: [{ uses: actions/checkout@11bd71901bbe5b1630ceea73d27597364c9af683 }]\n  \
           d:\n    permissions: {}\n    timeout-minutes: 5\n    \
             steps: [{ run: make, env: { X: '${{ secrets.X }}' } }]\n",
    );
    assert_eq!(
        broken(&workflow),
        [
            "the workflow needs `permissions: {}`",
            "a: no permissions of its own",
            "a: no time limit",
            "a: actions/checkout@v4 is not pinned by a commit",
            "a: a checkout leaves its token in the folder",
            "b: may write, and runs ./run.sh",
            "b: may write, and runs echo",
            "b: may write, and runs cargo",
            "c: a checkout leaves its token in the folder",
            "c: may write, and uses actions/checkout@11bd71901bbe5b1630ceea73d27597364c9af683",
            "d: may write, and runs make",
        ]
    );
}
