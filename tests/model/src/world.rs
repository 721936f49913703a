//! Three robots and what is on its way between them.
//!
//! The network is the set of all frames that were ever sent. Any of them may arrive anywhere at any time: a frame that never
//! does is lost, one that arrives again was doubled, and there is no order.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use bittybuzz_vm_core::message::CLOCK_MAX;
use stateright::{Model, Property};

use crate::replica::{Event, Frame, KEYS, ROBOTS, Replica, Rule, Stamp, digest, react};

/// How much happens.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Handler of conflicts.
    pub rule: Rule,
    /// Puts and deletions, of all robots together.
    pub puts: u8,
    /// How often robots empty their replicas, together.
    pub forgets: u8,
    /// How often robots ask for a value, together.
    pub gets: u8,
    /// The clock of an entry that all robots know at first; 0: they know nothing.
    pub start: u32,
    /// Frames that somebody forges: entries with any of some clocks, by a robot that there is or is not.
    pub forged: u8,
}

/// A state.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct World {
    /// What each robot knows.
    pub replicas: [Replica; ROBOTS.len()],
    /// All frames ever sent.
    pub network: BTreeSet<Frame>,
    puts: u8,
    forgets: u8,
    gets: u8,
    forged: u8,
    /// True if a robot lost an entry after it received one, or did not store the received one.
    pub has_gone_back: bool,
}

/// What happens next, and to which robot.
pub type Action = (usize, Event);

/// Clocks before the first one that count as earlier.
const EARLIER: u32 = 1000;
/// The forged clock that is far ahead. Half the circle is 2,097,151.
const AHEAD: u32 = 1_000_000;
/// The robot id of a forger that does not use that of a robot.
const FORGER: u16 = 999;
/// A value that is put when all is quiet.
const LAST: i32 = 40;

impl Bounds {
    /// The position of a clock in the part of the circle that is in use. A second implementation, as an oracle.
    fn position(&self, clock: u32) -> u32 {
        (clock + CLOCK_MAX + EARLIER - self.start.max(1)) % CLOCK_MAX
    }

    /// By what values under a key are compared: the greatest is kept.
    fn rank(&self, stamp: &Stamp) -> impl Ord + use<> {
        let (clock, robot) = (self.position(stamp.clock), i32::from(stamp.robot));
        match self.rule {
            Rule::Default => (clock, stamp.value.is_some(), robot, stamp.value),
            Rule::LowerRobot => (clock, true, -robot, stamp.value),
        }
    }

    /// The frames that may be forged.
    fn forgeries(&self) -> impl Iterator<Item = Frame> + use<> {
        let clocks = [self.start % CLOCK_MAX + 1, (self.start + AHEAD) % CLOCK_MAX, CLOCK_MAX];
        let values = [None, Some(50)];
        clocks.into_iter().flat_map(move |clock| {
            [ROBOTS[1], FORGER].into_iter().flat_map(move |robot| {
                values.into_iter().map(move |value| (0, Stamp { clock, robot, value }))
            })
        })
    }
}

/// To whom what happens, and what that robot knows.
type Question = (u16, Rule, Replica, Event);
/// What it knows then, and what it sends.
type Answer = (Replica, Vec<Frame>);

thread_local! {
    /// Reactions of robots that are known, as most states differ elsewhere.
    static REACTIONS: RefCell<HashMap<Question, Answer>> = RefCell::default();
}

fn reaction(robot: u16, rule: Rule, known: &Replica, event: Event) -> Answer {
    let question = (robot, rule, known.clone(), event);
    if let Some(answer) = REACTIONS.with_borrow(|known| known.get(&question).cloned()) {
        return answer;
    }
    let answer = react(robot, rule, known, event);
    REACTIONS.with_borrow_mut(|known| known.insert(question, answer.clone()));
    answer
}

thread_local! {
    static DIGESTS: RefCell<HashMap<Replica, u32>> = RefCell::default();
}

fn digest_of(known: &Replica) -> u32 {
    if let Some(sum) = DIGESTS.with_borrow(|sums| sums.get(known).copied()) {
        return sum;
    }
    let sum = digest(known);
    DIGESTS.with_borrow_mut(|sums| sums.insert(known.clone(), sum));
    sum
}

/// The values that are not deleted.
fn live(known: &Replica) -> Replica {
    known
        .iter()
        .filter(|(_, stamp)| stamp.value.is_some())
        .map(|(key, stamp)| (*key, *stamp))
        .collect()
}

impl Bounds {
    /// What all robots know when everything that is on its way is lost, and from then on all frames between neighbors in a
    /// row arrive; `None` if that does not come to an end.
    pub fn settle(&self, world: &World) -> Option<[Replica; ROBOTS.len()]> {
        let mut replicas = world.replicas.clone();
        // Twice the row's length is enough for all to know all, and once more shows that nothing changes.
        for _ in 0..2 * ROBOTS.len() {
            let before = replicas.clone();
            for from in 0..ROBOTS.len() {
                let (_, frames) = reaction(ROBOTS[from], self.rule, &replicas[from], Event::Idle);
                for to in [from.wrapping_sub(1), from + 1] {
                    let Some(replica) = replicas.get_mut(to) else { continue };
                    for frame in &frames {
                        let heard = Event::Hear(*frame);
                        (*replica, _) = reaction(ROBOTS[to], self.rule, replica, heard);
                    }
                }
            }
            if before == replicas {
                return Some(replicas);
            }
        }
        None
    }

    /// Whether all robots end up with the latest of what any of them knows.
    fn converges(&self, world: &World) -> bool {
        let latest = |key: i32| {
            let known = world.replicas.iter().filter_map(|replica| replica.get(&key).copied());
            known.max_by_key(|stamp| self.rank(stamp)).map(|stamp| (key, stamp))
        };
        let expected: Replica = (0..KEYS).filter_map(latest).collect();
        let expected = live(&expected);
        self.settle(world)
            .is_some_and(|replicas| replicas.iter().all(|known| live(known) == expected))
    }

    /// Returns true if a put over an entry reaches all robots, once all is quiet. Checked where a clock may be special.
    ///
    /// Deletions are not advertised, so two robots may keep those of different clocks until they forget them after 64 s. Before, a put
    /// over the earlier deletion is deleted in turn by the robot with the later one, and only the next put reaches all. Such worlds
    /// are not checked.
    fn is_writable(&self, world: &World) -> bool {
        if self.forged == 0 && self.start == 0 {
            return true;
        }
        let Some(replicas) = self.settle(world) else { return false };
        let entries: BTreeSet<&Stamp> = replicas.iter().filter_map(|known| known.get(&0)).collect();
        if entries.len() > 1 && entries.iter().all(|entry| entry.value.is_none()) {
            return true;
        }
        let knows = |robot: &usize| replicas[*robot].contains_key(&0);
        (0..ROBOTS.len()).filter(knows).all(|robot| {
            let mut next = World { replicas: replicas.clone(), ..world.clone() };
            let put = Event::Put(0, Some(LAST));
            (next.replicas[robot], _) =
                reaction(ROBOTS[robot], self.rule, &next.replicas[robot], put);
            let has_last = |known: &Replica| known.get(&0).is_some_and(|s| s.value == Some(LAST));
            self.settle(&next).is_some_and(|replicas| replicas.iter().all(has_last))
        })
    }

    /// Returns true if the digests of robots differ exactly when their replicas differ.
    fn digests_are_right(world: &World) -> bool {
        let known: Vec<_> =
            world.replicas.iter().map(|replica| (live(replica), digest_of(replica))).collect();
        let equal = |((one, one_sum), (other, other_sum))| (one == other) == (one_sum == other_sum);
        (1..known.len()).all(|place| equal((known[0].clone(), known[place].clone())))
    }

    /// Whether what a robot knows after an event is what it should.
    fn is_right(&self, before: &Replica, event: Event, after: &Replica) -> bool {
        (0..KEYS).all(|key| {
            let (before, after) = (before.get(&key), after.get(&key));
            match event {
                Event::Hear((heard, stamp)) if heard == key && stamp.clock != 0 => {
                    let both = before.copied().into_iter().chain([stamp]);
                    let latest = both.max_by_key(|stamp| self.rank(stamp));
                    // The deletion of a key that is not there is not kept.
                    let is_kept = before.is_some() || stamp.value.is_some();
                    after.copied() == latest.filter(|_| is_kept)
                }
                Event::Put(put, value) if put == key => match after {
                    Some(after) => {
                        after.value == value
                            && before.is_none_or(|before| {
                                self.position(after.clock) > self.position(before.clock)
                            })
                    }
                    None => before.is_none() && value.is_none(),
                },
                Event::Forget => after.is_none(),
                _ => before == after,
            }
        })
    }
}

impl Model for Bounds {
    type State = World;
    type Action = Action;

    fn init_states(&self) -> Vec<World> {
        let first = Stamp { clock: self.start, robot: ROBOTS[0], value: Some(9) };
        let known: Replica = (self.start != 0).then_some((0, first)).into_iter().collect();
        vec![World {
            replicas: [known.clone(), known.clone(), known],
            network: BTreeSet::new(),
            puts: 0,
            forgets: 0,
            gets: 0,
            forged: 0,
            has_gone_back: false,
        }]
    }

    fn actions(&self, world: &World, actions: &mut Vec<Action>) {
        if world.forged < self.forged {
            actions.extend(self.forgeries().map(|frame| (0, Event::Forge(frame))));
        }
        for robot in 0..ROBOTS.len() {
            actions.extend(world.network.iter().map(|frame| (robot, Event::Hear(*frame))));
            if world.puts < self.puts {
                // Every value is another one.
                for value in [None, Some(i32::from(world.puts) + 1)] {
                    actions.extend((0..KEYS).map(|key| (robot, Event::Put(key, value))));
                }
            }
            if world.gets < self.gets {
                actions.extend((0..KEYS).map(|key| (robot, Event::Get(key))));
            }
            if world.forgets < self.forgets {
                actions.push((robot, Event::Forget));
            }
        }
    }

    fn next_state(&self, world: &World, (robot, event): Action) -> Option<World> {
        if let Event::Forge(frame) = event {
            let mut next = world.clone();
            next.forged += 1;
            return next.network.insert(frame).then_some(next);
        }
        let before = &world.replicas[robot];
        let (after, sent) = reaction(ROBOTS[robot], self.rule, before, event);
        let mut next = world.clone();
        next.has_gone_back |= !self.is_right(before, event, &after);
        next.replicas[robot] = after;
        next.network.extend(sent);
        match event {
            Event::Put(..) => next.puts += 1,
            Event::Get(_) => next.gets += 1,
            Event::Forget => next.forgets += 1,
            Event::Hear(_) | Event::Idle | Event::Forge(_) => {}
        }
        (next != *world).then_some(next)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![
            Property::always("a replica never goes back", |_, world: &World| !world.has_gone_back),
            Property::always("equal stamps are equal values", |model: &Bounds, world: &World| {
                // A robot that forgets its own puts starts to count again; a forger may use its id.
                model.forgets > 0 || model.forged > 0 || has_unique_stamps(world)
            }),
            Property::always(
                "all robots agree when messages arrive",
                |model: &Bounds, world: &World| model.converges(world),
            ),
            Property::always(
                "a put when all is quiet reaches all",
                |model: &Bounds, world: &World| model.is_writable(world),
            ),
            Property::always("digests are equal where replicas are", |_, world: &World| {
                Bounds::digests_are_right(world)
            }),
            Property::sometimes("robots disagree about a clock", |_, world: &World| {
                let of =
                    |replica: &Replica| replica.get(&0).map(|stamp| (stamp.clock, stamp.robot));
                let (first, second) = (of(&world.replicas[0]), of(&world.replicas[1]));
                matches!((first, second), (Some(one), Some(two)) if one.0 == two.0 && one.1 != two.1)
            }),
        ]
    }
}

fn has_unique_stamps(world: &World) -> bool {
    let known = world.replicas.iter().flatten().map(|(key, stamp)| (*key, *stamp));
    let all: BTreeSet<Frame> = known.chain(world.network.iter().copied()).collect();
    let questions = all.iter().filter(|(_, stamp)| stamp.clock == 0).count();
    let stamps = all.iter().filter(|(_, stamp)| stamp.clock != 0);
    let distinct: BTreeSet<_> =
        stamps.map(|(key, stamp)| (*key, stamp.clock, stamp.robot)).collect();
    distinct.len() + questions == all.len()
}
