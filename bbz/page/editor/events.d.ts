// Written by `BITTYBUZZ_WRITE_DECLARATIONS=1 cargo test -p bittybuzz-live declarations` from the types of live/src/page_event.rs.

export type AboutDescription = { 
/**
 * The paragraphs of the comment with which the scenario begins.
 */
text: Array<Paragraph>, scripts: Array<ScriptAbout>, proposals: Array<Proposal>, };

export type ActivityName = "empty" | "idle" | "running" | "waiting" | "faulted" | "resting";

export type AnswerKind = "value" | "missing";

export type AnswersEvent = { lines: Array<LogEvent>, };

export type AssignmentDescription = { 
/**
 * The task in other languages, by their codes, such as `fr`.
 */
translations: { [key in string]: TaskDescription }, title: string, 
/**
 * The task in words.
 */
text: string, };

export type AttitudeDescription = { 
/**
 * The number of the robot.
 */
robot: number, 
/**
 * Degrees; positive lifts the left side.
 */
roll: number, 
/**
 * Degrees; positive lowers the nose.
 */
pitch: number, 
/**
 * Percent of the thrust in hover.
 */
thrust: number, };

export type AttitudesEvent = { robots: Array<AttitudeDescription>, };

export type BandDescription = { 
/**
 * The quantity, written as in `plot`.
 */
quantity: string, 
/**
 * The first and the last time.
 */
from: number, to: number, 
/**
 * The smallest and the greatest value; `null` if there is no limit.
 */
low: number | null, high: number | null, };

export type BatteryDescription = { 
/**
 * Voltage in mV.
 */
millivolts: number, 
/**
 * Remaining charge, 0 to 1; `null` if only the voltage is known.
 */
charge: number | null, };

export type BeginEvent = { 
/**
 * Present for a recording.
 */
recording?: RecordingDescription, 
/**
 * Present, and true, for robots outside the simulator.
 */
watched?: boolean, 
/**
 * Width and height.
 */
size: [number, number], ticks_per_second: number, 
/**
 * The last tick.
 */
end: number, 
/**
 * `null` outside the simulator.
 */
seed: number | null, groups: Array<GroupDescription>, 
/**
 * Later patches lie over earlier ones.
 */
ground: Array<PatchDescription>, obstacles: Array<ObstacleDescription>, 
/**
 * The discs that robots push. The samples have their places.
 */
movables: Array<MovableDescription>, lights: Array<LightDescription>, pose_errors: Array<PoseErrorDescription>, media: Array<MediumDescription>, 
/**
 * The times of the scenario's events.
 */
events: Array<number>, commands: Array<CommandDescription>, quantities: QuantityNames, expectations: Array<ExpectationDescription>, measures: Array<MeasureDescription>, assignment: AssignmentDescription | null, 
/**
 * Present if scripts can be edited.
 */
scripts?: ScriptsDescription, 
/**
 * Present if scripts can be edited.
 */
controls?: Array<Control>, 
/**
 * Present if scripts can be edited.
 */
about?: AboutDescription, 
/**
 * Present in a session: true if the run pauses at a fault.
 */
stops_on_error?: boolean, };

export type BreakpointDescription = { 
/**
 * The name of the script.
 */
script: string, 
/**
 * The line that the client asked for.
 */
line: number, 
/**
 * The next line with a statement; `null` if there is none.
 */
at: number | null, };

export type BreakpointsEvent = { 
/**
 * Empty if the client asked for none, and in a world that cannot pause there.
 */
lines: Array<BreakpointDescription>, };

export type BuiltEvent = { 
/**
 * The text of the scenario before the change.
 */
before: string, 
/**
 * The text of the scenario now.
 */
text: string, 
/**
 * The thing that was added or changed; `null` after a deletion.
 */
thing: Thing | null, };

export type Button = { 
/**
 * The name of the global.
 */
name: string, 
/**
 * The number that the script assigns to the global, if it is a literal.
 */
value: number | null, };

export type ChangedEvent = { name: string, 
/**
 * The text of the file; `null` if it cannot be read.
 */
saved: string | null, 
/**
 * SHA-256 of that text in hexadecimal; empty if the file cannot be read.
 */
sha256: string, };

export type CommandDescription = { 
/**
 * The tick before which the command acts.
 */
tick: number, text: string, };

export type CommandsEvent = { 
/**
 * The commands as `[[event]]`s of a scenario.
 */
text: string, };

export type CompilerMessage = { severity: MessageSeverity, 
/**
 * The code, such as `E0201`. Messages about a scenario have none.
 */
code?: string, message: string, label: string | null, help: string | null, 
/**
 * The place, which is absent from a message about a file as a whole. Lines and columns count
 * from 1.
 */
file?: string, line?: number, column?: number, end_line?: number, end_column?: number, 
/**
 * Other places that the message refers to.
 */
related: Array<RelatedPlace>, 
/**
 * Changes of the text that the message suggests.
 */
edits: Array<SuggestedEdit>, };

export type ConditionsEvent = { lights: Array<LightDescription>, pose_errors: Array<PoseErrorDescription>, 
/**
 * All commands, including those that are pending because the run was taken back.
 */
commands: Array<CommandDescription>, 
/**
 * True if a change of the commands can be undone.
 */
can_undo: boolean, 
/**
 * True if a change was undone that can be done again.
 */
can_redo: boolean, };

export type Control = { "kind": "slider" } & Slider | { "kind": "switch" } & Switch | { "kind": "button" } & Button;

export type DefectEvent = { 
/**
 * The version, the place and the invariant that does not hold.
 */
text: string, 
/**
 * Advice for the user.
 */
help: string, };

export type DiagnosticsEvent = { name: string, diagnostics: Array<CompilerMessage>, };

export type DigestEvent = { tick: number, 
/**
 * Hexadecimal, because JavaScript numbers do not hold 64 bits.
 */
digest: string, };

export type EntryDescription = { key: ValueDescription, value: ValueDescription, 
/**
 * The id of the robot that wrote the value.
 */
owner: number, 
/**
 * The Lamport clock of the write.
 */
clock: number, is_own: boolean, is_unsent: boolean, };

export type ExpectationDescription = { name: string | null, 
/**
 * The expectation in words.
 */
text: string, 
/**
 * The line of the scenario.
 */
line: number, 
/**
 * The values that it wants; `null` if they are not a range of numbers.
 */
band: BandDescription | null, };

export type ExpectationEvent = { 
/**
 * The number of the expectation in the scenario.
 */
number: number, verdict: VerdictName, 
/**
 * The tick at which the verdict was decided.
 */
tick: number | null, };

export type ExpectationVerdict = { 
/**
 * The name of the expectation, if it has one.
 */
name: string | null, 
/**
 * The expectation in words.
 */
text: string, 
/**
 * True if the expectation held.
 */
held: boolean, 
/**
 * The time in seconds since which its condition was true until the end; `null` if it was false
 * at the end.
 */
since: number | null, 
/**
 * The time in seconds at which it was decided that the expectation held; `null` if it failed.
 */
held_at: number | null, };

export type ExplanationEvent = { 
/**
 * The code of the message.
 */
code: string, 
/**
 * Markdown.
 */
text: string, };

export type FailedEvent = { 
/**
 * The reason.
 */
text: string, };

export type FaultConsequence = "contained" | "pause" | "stop";

export type FaultEvent = { tick: number, 
/**
 * The number of the robot.
 */
robot: number, consequence: FaultConsequence, 
/**
 * The code, such as `R0001`.
 */
code: string, 
/**
 * The mistake, in one sentence without a full stop.
 */
message: string, help: string | null, 
/**
 * Further remarks, such as the use of a memory that was full.
 */
notes: Array<string>, 
/**
 * The values that the instruction used, if the machine was inspected at that moment.
 */
values: Array<FaultValue>, 
/**
 * The calls that led to the error, innermost first; `null` without symbols. Of many calls,
 * only the first and the last ones.
 */
places: Array<FaultPlace | null>, 
/**
 * The number of calls that `places` lacks.
 */
left_out: number, };

export type FaultPlace = { file: string, line: number, column: number, end_line: number, end_column: number, 
/**
 * The name of the function; `null` if the symbols have none.
 */
function: string | null, 
/**
 * The text of the line, if it is known.
 */
text: string | null, 
/**
 * The name of the script in the client's editor; `null` if the client cannot edit it.
 */
script: string | null, };

export type FaultValue = { 
/**
 * The name as it is written in the script, such as `speeds[i]`.
 */
name: string, 
/**
 * The value as a script would write it.
 */
value: string, };

export type FenceDescription = { 
/**
 * The least x and y.
 */
least: [number | null, number | null], 
/**
 * The greatest x and y.
 */
most: [number | null, number | null], 
/**
 * The greatest height.
 */
height: number | null, };

export type FrameDescription = { 
/**
 * The name of the function.
 */
function: string, 
/**
 * The place of the current instruction; `null` if it is not known.
 */
source: FrameSource | null, locals: Array<NamedValue>, };

export type FrameSource = { file: string, line: number, column: number, };

export type GlyphName = "disc" | "legs" | "wheels" | "rotors";

export type GroupDescription = { name: string | null, 
/**
 * The name of the robots' model.
 */
robot: string | null, 
/**
 * The path of the script, relative to the folder of the scenario.
 */
script: string | null, 
/**
 * The form of the robots in pictures.
 */
glyph: GlyphName, count: number, first_id: number, 
/**
 * The radius of a body in mm.
 */
radius: number, 
/**
 * The link between the robots; `null` if it is not known.
 */
link: LinkDescription | null, 
/**
 * The slots of a machine.
 */
slots: number | null, 
/**
 * The mean velocity of the wind that the robots feel, along x and y in mm/s.
 */
wind: [number, number] | null, 
/**
 * The keys of the scenario by which the surroundings of the robots differ from usual ones.
 */
surroundings: Array<SurroundingsDescription>, 
/**
 * The box that the robots do not leave in flight.
 */
fence: FenceDescription | null, };

export type HandlerDescription = { trigger: TriggerDescription, function: ValueDescription, };

export type InspectionEvent = { 
/**
 * The number of the robot.
 */
robot: number, tick: number, 
/**
 * `null` if the machine runs in an emulator, or the robot has not joined yet.
 */
memory: MemoryDescription | null, 
/**
 * The last fault of the robot.
 */
fault: FaultEvent | null, 
/**
 * The memory at that fault, which the robot has forgotten since; `null` if the machine runs in
 * an emulator.
 */
at_fault: MemoryDescription | null, battery: BatteryDescription | null, 
/**
 * The place in mm at which the robot believes to be; an emulated one reports it by radio.
 */
estimate: [number, number, number] | null, };

export type LedMeaning = { 
/**
 * The sum of 1 for red, 2 for green and 4 for blue, as `led()` takes it.
 */
color: number, meaning: string, 
/**
 * The code of the language, such as `fr`; `null` is the language of the script.
 */
language: string | null, };

export type LightDescription = { 
/**
 * The position in mm.
 */
at: [number, number], brightness: number, };

export type LinkDescription = { 
/**
 * The name of the medium.
 */
medium: string, 
/**
 * The range in mm; `null` is unlimited.
 */
range: number | null, 
/**
 * True if the range is measured between the rims of two robots, not between their middles.
 */
is_between_rims: boolean, };

export type LogEvent = { tick: number, 
/**
 * The number of the robot.
 */
robot: number, text: string, 
/**
 * The kind of an answer to a question; `null` for a line that the script logged.
 */
answer?: AnswerKind, };

export type LogsEvent = { 
/**
 * The number of earlier lines and faults that are left out, because the client was slow.
 */
lost: number, lines: Array<LogEvent>, };

export type Mark = { 
/**
 * The name of the file.
 */
file: string, 
/**
 * True if its scripts ran.
 */
runs: boolean, 
/**
 * The reason why the scripts do not run, or why the results differ from those of the file.
 */
reason: string | null, 
/**
 * The results; `null` if the scripts do not run.
 */
ran: RanMark | null, };

export type MarksEvent = { 
/**
 * The marks, in the order of the files.
 */
marks: Array<Mark>, 
/**
 * The marks as a table.
 */
csv: string, };

export type MeasureDescription = { name: string, 
/**
 * The measure in words.
 */
text: string, 
/**
 * True if it is the time in seconds at which a condition is true first.
 */
is_time: boolean, };

export type MeasuresEvent = { 
/**
 * The number of each measure; `null` if it is not known yet, or not finite.
 */
values: Array<number | null>, };

export type MediumDescription = { name: string, 
/**
 * The share of frames that the scenario lets the medium lose, for robots that touch and at the
 * end of the range; `null` stands for the physical model's.
 */
loss: [number, number] | null, };

export type MemoryDescription = { activity: ActivityName, globals: Array<NamedValue>, 
/**
 * The active functions, innermost first.
 */
frames: Array<FrameDescription>, neighbors: Array<NeighborDescription>, swarms: Array<SwarmDescription>, stigmergies: Array<StigmergyDescription>, handlers: Array<HandlerDescription>, queues: QueuesDescription | null, slots: SlotsDescription, 
/**
 * The tables and closures to which values refer by their numbers.
 */
objects: { [key in number]: ObjectDescription }, };

export type MessageDescription<V> = { "kind": "broadcast", 
/**
 * The id of the sender.
 */
robot: number, 
/**
 * The topic, a string.
 */
topic: V, value: V, } | { "kind": "entry", 
/**
 * The number of the stigmergy in the script.
 */
stigmergy: number, 
/**
 * The id of the robot that wrote the value or that sends the query.
 */
owner: number, 
/**
 * The Lamport clock of the write; 0 for a query.
 */
clock: number, key: V, value: V, } | { "kind": "beacon", 
/**
 * The id of the sender.
 */
robot: number, } | { "kind": "digest", 
/**
 * The id of the sender.
 */
robot: number, 
/**
 * The sum over the sender's entries.
 */
digest: number, 
/**
 * The latest clock of a deletion that the sender has forgotten.
 */
floor: number, } | { "kind": "swarms", 
/**
 * The id of the sender.
 */
robot: number, 
/**
 * The numbers of swarms; true if the sender is a member.
 */
swarms: Array<[number, boolean]>, } | { "kind": "fragment", 
/**
 * The id of the sender.
 */
robot: number, 
/**
 * The number of the message.
 */
number: number, 
/**
 * The index of the part.
 */
index: number, 
/**
 * True for the last part.
 */
is_last: boolean, } | { "kind": "foreign" } | { "kind": "malformed" };

export type MessageSeverity = "error" | "warning";

export type MessagesEvent = { tick: number, heard: Array<[number, number]>, collided: Array<[number, number]>, lost: Array<[number, number]>, };

export type MovableDescription = { radius: number, height: number | null, };

export type NamedValue = [string, ValueDescription];

export type NeighborDescription = { id: number, 
/**
 * The distance in mm; `null` if the link did not measure the place.
 */
distance: number | null, 
/**
 * The azimuth in radians.
 */
azimuth: number | null, 
/**
 * The elevation in radians.
 */
elevation: number | null, 
/**
 * The number of steps after which the neighbor is removed if nothing more is received from it.
 */
steps_left: number, swarms: Array<number>, };

export type ObjectDescription = { 
/**
 * Keys and values.
 */
entries: Array<[ValueDescription, ValueDescription]>, 
/**
 * The number of further entries.
 */
left_out: number, } | { function: string, self: ValueDescription, captures: Array<NamedValue>, } | { function: ValueDescription, self: ValueDescription, };

export type ObstacleDescription = { at: [number, number], radius: number, height: number | null, } | { at: [number, number], size: [number, number], heading: number, height: number | null, } | { from: [number, number], to: [number, number], height: number | null, };

export type OtherValue = { "unset": boolean } | { "float": string } | { "string": number } | { "table": number } | { "closure": number } | { "function": string } | { "builtin": string } | { "robot_function": string } | { "library": string } | { "swarm": number } | { "stigmergy": number };

export type PageEvent = { "event": "begin" } & BeginEvent | { "event": "state" } & StateEvent | { "event": "seeking" } & SeekingEvent | { "event": "conditions" } & ConditionsEvent | { "event": "logs" } & LogsEvent | { "event": "log_cleared" } | { "event": "answers" } & AnswersEvent | { "event": "fault" } & FaultEvent | { "event": "stopped" } & StoppedEvent | { "event": "stepped" } & SteppedEvent | { "event": "breakpoints" } & BreakpointsEvent | { "event": "expectation" } & ExpectationEvent | { "event": "measures" } & MeasuresEvent | { "event": "inspection" } & InspectionEvent | { "event": "attitudes" } & AttitudesEvent | { "event": "messages" } & MessagesEvent | { "event": "quantity" } & QuantityEvent | { "event": "series" } & SeriesEvent | { "event": "series_cut" } & SeriesCutEvent | { "event": "series_progress" } & SeriesProgressEvent | { "event": "commands" } & CommandsEvent | { "event": "scenario" } & ScenarioEvent | { "event": "script" } & ScriptEvent | { "event": "diagnostics" } & DiagnosticsEvent | { "event": "ran" } & RanEvent | { "event": "written" } & WrittenEvent | { "event": "changed" } & ChangedEvent | { "event": "explanation" } & ExplanationEvent | { "event": "digest" } & DigestEvent | { "event": "trials" } & TrialsEvent | { "event": "trial" } & TrialEvent | { "event": "result" } & ResultEvent | { "event": "marks" } & MarksEvent | { "event": "began" } | { "event": "built" } & BuiltEvent | { "event": "refused" } & RefusedEvent | { "event": "failed" } & FailedEvent | { "event": "defect" } & DefectEvent;

export type Paragraph = { text: string, 
/**
 * The code of the language, such as `fr`; `null` is the language of the file.
 */
language: string | null, };

export type PatchDescription = { at: [number, number], radius: number, brightness: number, } | { at: [number, number], size: [number, number], heading: number, brightness: number, };

export type PoseErrorDescription = { 
/**
 * The number of the robot.
 */
robot: number, 
/**
 * The displacement along x and y in mm.
 */
displaced: [number, number], 
/**
 * The number of the robot whose poses it gets in place of its own.
 */
seen_as: number | null, };

export type Proposal = { label: string, 
/**
 * The command, as the client requests it.
 */
command: string, 
/**
 * The code of the label's language, such as `fr`; `null` is the language of the scenario.
 */
language: string | null, };

export type QuantityEvent = { tick: number, name: string, 
/**
 * A number for each robot, or a single one for the swarm.
 */
values: Array<number | null>, };

export type QuantityNames = { 
/**
 * Those of `plot` in the scenario.
 */
plot: Array<string>, 
/**
 * Those of each robot.
 */
robot: Array<string>, 
/**
 * Those of the swarm.
 */
swarm: Array<string>, 
/**
 * Globals of the scripts.
 */
global: Array<string>, };

export type QueueDescription = { 
/**
 * The number of frames that the queue can hold.
 */
capacity: number, messages: Array<MessageDescription<ValueDescription>>, };

export type QueuesDescription = { inbox: QueueDescription, outbox: QueueDescription, };

export type RanEvent = { 
/**
 * The script of which the text is a draft.
 */
name: string, 
/**
 * The name of the draft.
 */
draft: string, quantities: QuantityNames, controls: Array<Control>, 
/**
 * The texts about the scripts.
 */
about: Array<ScriptAbout>, };

export type RanMark = { 
/**
 * The name of the person who handed it in.
 */
by: string, 
/**
 * True if every expectation held, and no script had an unexpected fault.
 */
success: boolean, 
/**
 * The expectations, in the order of the scenario.
 */
expectations: Array<ExpectationVerdict>, 
/**
 * The digest at the end of the run, in hexadecimal.
 */
digest: string, 
/**
 * True if the results are those of the file.
 */
as_handed_in: boolean, 
/**
 * The other files whose scripts are compiled to the same programs.
 */
same_scripts: Array<string>, };

export type RecordingDescription = { 
/**
 * The name of its file, if it has one.
 */
name: string | null, 
/**
 * The error that ends the recording early; `null` if it is complete.
 */
cut: string | null, };

export type RefusedEvent = { 
/**
 * The reason.
 */
text: string, help: string | null, };

export type RelatedPlace = { file: string, line: number, column: number, end_line: number, end_column: number, label: string, };

export type Request = { "play": { 
/**
 * The speed as a multiple of real time; `null` is as fast as possible.
 */
rate?: number, } } | "pause" | { "step": { 
/**
 * The number of ticks to run.
 */
ticks: number, } } | { "go_to": { 
/**
 * The tick to go to. A tick after the end means the end.
 */
tick: number, } } | { "command": { 
/**
 * The keys of an `[[event]]` without `at`.
 */
text: string, } } | "undo" | "redo" | { "delete_command": { 
/**
 * The number of the command in the list of all commands.
 */
number: number, } } | { "inspect": { 
/**
 * The number of the robot in the scenario; `null` ends the subscription.
 */
robot: number | null, } } | { "watch": { 
/**
 * True to receive messages.
 */
messages: boolean, 
/**
 * The quantity, written as in `plot`.
 */
quantity: string | null, } } | { "series": { 
/**
 * The quantities, written as in `plot`. Curves that are not named end.
 */
quantities: Array<string>, 
/**
 * The numbers of the robots whose own values are in the events, too.
 */
robots: Array<number>, } } | "stop_series" | { "stop_on_error": { on: boolean, } } | { "debug": { 
/**
 * The number of the robot.
 */
robot: number, to: StepTo, } } | { "breakpoints": { 
/**
 * The lines of scripts, by the names of the scripts.
 */
lines: { [key in string]: Array<number> }, 
/**
 * The number of the only robot for which the run pauses; `null` stands for all.
 */
robot: number | null, } } | "commands" | "scenario" | { "script": { 
/**
 * The path of the script relative to the folder of the scenario.
 */
name: string, } } | { "check": { 
/**
 * The script that the text would replace.
 */
name: string, text: string, } } | { "run": { 
/**
 * The texts that the client shows. A text that is not given stays as it is; that of a script
 * which no robot has is ignored.
 */
texts: { [key in string]: string }, 
/**
 * True if the session's commands act again at their times, except those that load scripts.
 */
keep_changes: boolean, } } | { "build": { edit: WorldEdit, 
/**
 * The texts that the client shows, as for `Run`. The text of the scenario must be the one
 * with which the run began: numbers of things count in it.
 */
texts: { [key in string]: string }, keep_changes: boolean, } } | { "load": { 
/**
 * The script of which the text is a draft.
 */
name: string, text: string, 
/**
 * The ids of the robots; `null` selects all that have the script.
 */
robots?: Array<number>, 
/**
 * True if globals that hold numbers keep them.
 */
keep: boolean, } } | { "write": { 
/**
 * The path of the script relative to the folder of the scenario.
 */
name: string, text: string, 
/**
 * SHA-256 of the text that the client takes for that of the file. If the file has another
 * one, it is not written. `null` writes it in any case.
 */
over: string | null, } } | { "unsaved": { 
/**
 * The script, or the scenario.
 */
name: string, 
/**
 * `null` if no text of this client is unsaved.
 */
text: string | null, 
/**
 * SHA-256 of the text of the file.
 */
over: string, } } | { "discard": { 
/**
 * The `id` of the text.
 */
id: string, } } | { "explain": { 
/**
 * The code of the message.
 */
code: string, } } | "digest" | { "sweep": { 
/**
 * A key of the scenario, such as `medium.ir.loss`, or a global, such as `global.JOIN`;
 * `null` varies nothing.
 */
key: string | null, 
/**
 * The values of the key.
 */
values: Array<string>, 
/**
 * The number of seeds for each value.
 */
seeds: number, 
/**
 * The quantity that is measured at the end of each trial, written as in `plot`.
 */
quantity: string | null, } } | { "hand_in": { 
/**
 * The name of the person who hands it in.
 */
by: string, 
/**
 * The texts that the client shows. If the run is not one of these texts, nothing is handed in.
 */
texts: { [key in string]: string }, } } | { "grade": { 
/**
 * The texts of the files, by their names.
 */
files: { [key in string]: string }, } } | "stop_trials";

export type ResultEvent = { 
/**
 * The name of the file.
 */
name: string, 
/**
 * The content of the file.
 */
text: string, 
/**
 * The number of expectations that held.
 */
held: number, 
/**
 * The number of expectations.
 */
count: number, 
/**
 * True if every expectation held, and no script had an unexpected fault.
 */
success: boolean, };

export type ScenarioEvent = { 
/**
 * The scenario with all commands as its last events. It has the texts that the run needs.
 */
text: string, 
/**
 * The names of files that are no texts, so that the scenario needs them next to it.
 */
missing: Array<string>, };

export type ScriptAbout = { 
/**
 * The name of the script.
 */
name: string, 
/**
 * The paragraphs of the comment with which the script begins.
 */
text: Array<Paragraph>, leds: Array<LedMeaning>, };

export type ScriptEvent = { name: string, 
/**
 * The path of the file.
 */
file: string, text: string, 
/**
 * The text of the file, which differs from `text` if robots run a draft.
 */
saved: string, 
/**
 * SHA-256 of `saved` in hexadecimal; empty if the file cannot be read.
 */
sha256: string, 
/**
 * The names that the text may use.
 */
words: Array<Word>, };

export type ScriptsDescription = { 
/**
 * The names of the scripts.
 */
names: Array<string>, 
/**
 * The name of the scenario.
 */
scenario: string, 
/**
 * The path of the scenario.
 */
file: string, 
/**
 * The names of the scripts that the client may write to their files.
 */
writable: Array<string>, 
/**
 * The texts with which the run began. A script that could not be read then is missing.
 */
begun: { [key in string]: string }, 
/**
 * Texts that were typed earlier and not saved.
 */
unsaved: Array<UnsavedText>, };

export type SeekingEvent = { 
/**
 * The tick to which the run goes.
 */
tick: number, 
/**
 * The time in seconds that the rest of the way takes, as far as it can be known.
 */
left: number, };

export type SeriesCutEvent = { 
/**
 * The last tick of the way before.
 */
tick: number, };

export type SeriesEvent = { 
/**
 * The quantity, written as in `plot`.
 */
name: string, 
/**
 * The unit, if the quantity has one.
 */
unit: string | null, 
/**
 * The number of ticks from one point of the curve to the next.
 */
every: number, 
/**
 * True if the swarm has a single value.
 */
is_single: boolean, ticks: Array<number>, 
/**
 * The extremes, quartiles and median of all robots, in ascending order, for each tick. Empty if
 * the client has them, so that only the values of single robots are new.
 */
five: Array<[number | null, number | null, number | null, number | null, number | null]>, 
/**
 * The numbers of the robots whose own values follow.
 */
robots: Array<number>, 
/**
 * The values of these robots for each tick.
 */
own: Array<Array<number | null>>, };

export type SeriesProgressEvent = { 
/**
 * The percentage of the points up to now that are known, of all curves.
 */
percent: number, 
/**
 * The reason why the others stay unknown.
 */
problem: string | null, };

export type Slider = { 
/**
 * The name of the global.
 */
name: string, least: number, most: number, step: number, 
/**
 * True if the global gets floats.
 */
is_float: boolean, 
/**
 * The number that the script assigns to the global, if it is a literal.
 */
value: number | null, };

export type SlotsDescription = { stack: number, heap: number, free: number, };

export type StateEvent = { tick: number, 
/**
 * True while the run is not paused.
 */
plays: boolean, 
/**
 * The speed as a multiple of real time; `null` if the run is paused or has no limit.
 */
rate: number | null, 
/**
 * True at the end of the run.
 */
over: boolean, };

export type StatementDescription = { 
/**
 * The tick of the run. The statement is in the tick that follows.
 */
tick: number, 
/**
 * The number of the robot.
 */
robot: number, 
/**
 * The number of the statement in the tick, from 0.
 */
number: number, 
/**
 * The number of statements that the robot begins in the tick.
 */
count: number, place: FaultPlace, 
/**
 * The memory before the statement.
 */
memory: MemoryDescription, };

export type StepTo = "first" | "next" | "over" | "out" | "back" | "last" | { "at": number };

export type SteppedEvent = { 
/**
 * `null` after the run has left the statement.
 */
at: StatementDescription | null, };

export type StigmergyDescription = { number: number, entries: Array<EntryDescription>, };

export type StoppedEvent = { fault: FaultEvent, 
/**
 * The number of faults of other robots in the same tick.
 */
others: number, };

export type SuggestedEdit = { file: string, line: number, column: number, end_line: number, end_column: number, text: string, 
/**
 * True if the change is certainly right.
 */
certain: boolean, };

export type SurroundingsDescription = { 
/**
 * The name of the key.
 */
key: string, value: number, 
/**
 * The unit, if the number has one.
 */
unit: string, };

export type SwarmDescription = { number: number, is_member: boolean, is_unsent: boolean, };

export type Switch = { 
/**
 * The name of the global.
 */
name: string, 
/**
 * The number that the script assigns to the global, if it is a literal.
 */
value: number | null, };

export type TaskDescription = { title: string, 
/**
 * The task in words.
 */
text: string, };

export type Thing = { kind: ThingKind, 
/**
 * The number among the things of its kind, in the order of the `begin` event.
 */
number: number, };

export type ThingKind = "robot" | "obstacle" | "movable" | "lamp" | "patch";

export type ThingValues = { 
/**
 * The center.
 */
at?: [number, number], 
/**
 * The ends of a wall.
 */
from?: [number, number], to?: [number, number], 
/**
 * The radius of a disc.
 */
radius?: number, 
/**
 * Width and height of a box.
 */
size?: [number, number], 
/**
 * The heading of a robot or a box, in degrees.
 */
heading?: number, 
/**
 * The brightness of a lamp or of paint.
 */
brightness?: number, };

export type TrialEvent = { 
/**
 * The number of the trial, from 0.
 */
number: number, 
/**
 * The number of all trials.
 */
count: number, 
/**
 * The value of the key, as the client wrote it; `null` if no key is varied.
 */
value: string | null, seed: number, 
/**
 * True if every expectation held, and no script had an unexpected fault.
 */
success: boolean, verdicts: Array<VerdictName>, 
/**
 * The time in seconds since which each condition was true until the end; `null` if it was
 * false there.
 */
since: Array<number | null>, 
/**
 * The quantity of each robot at the end; `null` if no quantity is measured.
 */
numbers: Array<number | null> | null, };

export type TrialsEvent = { 
/**
 * 100 if no trial runs.
 */
percent: number, };

export type TriggerDescription = { "topic": ValueDescription } | { "conflict": number } | { "lost_conflict": number };

export type UnsavedText = { id: string, 
/**
 * The script, or the scenario.
 */
name: string, 
/**
 * The path of the file.
 */
file: string, 
/**
 * The time at which it was typed, in seconds since 1970.
 */
seconds: number, 
/**
 * True if the file has another text now than when it was changed.
 */
changed: boolean, text: string, };

export type ValueDescription = null | number | number | string | OtherValue;

export type VerdictName = "open" | "held" | "failed";

export type Word = { 
/**
 * The table before the dot, `*` for any variable, and empty for names without a dot.
 */
of: string, name: string, 
/**
 * The form of the call, as written in the help.
 */
call: string, help: string, 
/**
 * True for functions, and false for values.
 */
is_called: boolean, };

export type WorldEdit = { "add": { kind: ThingKind, 
/**
 * The number of the group of a robot.
 */
group?: number, values: ThingValues, } } | { "change": { thing: Thing, values: ThingValues, } } | { "copy": { thing: Thing, values: ThingValues, } } | { "delete": { thing: Thing, } };

export type WrittenEvent = { name: string, 
/**
 * SHA-256 of the text in hexadecimal.
 */
sha256: string, };
