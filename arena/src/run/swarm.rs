//! Measures of a swarm: one number for many robots.

use crate::engine::{RobotId, RobotState, RobotView, World};
use crate::scenario::Swarm;

use crate::robot::SimRobot;

/// The distance in mm between the rims of two robots up to which they count as touching. It
/// includes robots that have just pushed each other apart.
const CONTACT_GAP_MM: f64 = 1.0;

/// A robot of the swarm.
struct SwarmMember {
    id: RobotId,
    view: RobotView,
    at: [f64; 3],
}

/// Returns a measure of these robots; `None` if there are too few of them.
pub fn measure(
    of: Swarm,
    world: &World<SimRobot>,
    robots: impl Iterator<Item = RobotId>,
) -> Option<f64> {
    let mut members: Vec<SwarmMember> = robots
        .filter_map(|id| {
            let view = world.robot(id)?;
            let at = [view.pose.x, view.pose.y, view.pose.z].map(f64::from);
            Some(SwarmMember { id, view, at })
        })
        .collect();
    if of == Swarm::Components {
        let is_heard = |member: &SwarmMember| {
            let is_well = world.brain(member.id).is_some_and(|robot| !robot.state().is_faulted());
            is_well && member.view.state == RobotState::Running
        };
        members.retain(is_heard);
    }
    // The order by x limits the comparisons to robots with a similar x.
    members.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    let count = members.len() as f64;
    match of {
        Swarm::Components => Some(components(&members, world) as f64),
        Swarm::Contacts => Some(contacts(&members) as f64),
        Swarm::Cluster(distance) => Some(largest_cluster(&members, distance) as f64),
        Swarm::Polarisation | Swarm::Spread if members.is_empty() => None,
        Swarm::Polarisation => {
            let (mut east, mut north) = (0.0, 0.0);
            for member in &members {
                let (sine, cosine) = libm::sincos(f64::from(member.view.pose.heading));
                east += cosine;
                north += sine;
            }
            Some(libm::hypot(east, north) / count)
        }
        Swarm::Spread => {
            let mean =
                |axis: usize| members.iter().map(|member| member.at[axis]).sum::<f64>() / count;
            let (x, y) = (mean(0), mean(1));
            let squared =
                |member: &SwarmMember| (member.at[0] - x).powi(2) + (member.at[1] - y).powi(2);
            Some((members.iter().map(squared).sum::<f64>() / count).sqrt())
        }
        Swarm::Nearest if members.len() < 2 => None,
        Swarm::Nearest => {
            let distances = (0..members.len()).map(|index| nearest(&members, index));
            Some(distances.sum::<f64>() / count)
        }
    }
}

fn distance(one: &SwarmMember, other: &SwarmMember) -> f64 {
    let [dx, dy, dz] = [0, 1, 2].map(|axis| one.at[axis] - other.at[axis]);
    (dx * dx + dy * dy + dz * dz).sqrt()
}

/// Returns the distance from a member to the nearest other one.
fn nearest(members: &[SwarmMember], index: usize) -> f64 {
    let own = &members[index];
    let mut nearest = f64::INFINITY;
    let (before, after) = (members[..index].iter().rev(), members[index + 1..].iter());
    for other in before {
        if own.at[0] - other.at[0] >= nearest {
            break;
        }
        nearest = nearest.min(distance(own, other));
    }
    for other in after {
        if other.at[0] - own.at[0] >= nearest {
            break;
        }
        nearest = nearest.min(distance(own, other));
    }
    nearest
}

/// Returns the number of pairs that touch.
fn contacts(members: &[SwarmMember]) -> usize {
    let widest = members.iter().map(|member| f64::from(member.view.radius_mm)).fold(0.0, f64::max);
    let mut count = 0;
    for (index, one) in members.iter().enumerate() {
        let radius = f64::from(one.view.radius_mm) + CONTACT_GAP_MM;
        let height = f64::from(one.view.height_mm);
        let near = members[index + 1..].iter();
        let near = near.take_while(|other| other.at[0] - one.at[0] <= radius + widest);
        count += near
            .filter(|other| {
                let is_level = one.at[2] < other.at[2] + f64::from(other.view.height_mm)
                    && other.at[2] < one.at[2] + height;
                let flat = libm::hypot(one.at[0] - other.at[0], one.at[1] - other.at[1]);
                is_level && flat <= radius + f64::from(other.view.radius_mm)
            })
            .count();
    }
    count
}

/// Returns the number of connected components: groups of members that receive each other, directly
/// or through others.
fn components(members: &[SwarmMember], world: &World<SimRobot>) -> usize {
    let mut parts = members.len();
    let mut parents: Vec<usize> = (0..parts).collect();
    let reaches: Vec<f64> = members.iter().map(|member| world.reach_mm(member.id)).collect();
    for (index, one) in members.iter().enumerate() {
        for (other_index, other) in members.iter().enumerate().skip(index + 1) {
            // A link needs reception in both directions, so it is no longer than the shorter reach.
            if parts == 1 || other.at[0] - one.at[0] > reaches[index] {
                break;
            }
            let (root, other_root) = (root(&mut parents, index), root(&mut parents, other_index));
            if root != other_root
                && world.can_receive(one.id, other.id)
                && world.can_receive(other.id, one.id)
            {
                parents[other_root] = root;
                parts -= 1;
            }
        }
    }
    parts
}

/// Returns the number of members in the largest cluster: members that are at most `distance` apart
/// on the ground, directly or through others.
fn largest_cluster(members: &[SwarmMember], distance: f64) -> usize {
    let mut parents: Vec<usize> = (0..members.len()).collect();
    for (index, one) in members.iter().enumerate() {
        let near = members.iter().enumerate().skip(index + 1);
        let near = near.take_while(|(_, other)| other.at[0] - one.at[0] <= distance);
        for (other_index, other) in near {
            if libm::hypot(one.at[0] - other.at[0], one.at[1] - other.at[1]) <= distance {
                let root_of_one = root(&mut parents, index);
                let root_of_other = root(&mut parents, other_index);
                parents[root_of_other] = root_of_one;
            }
        }
    }
    let mut sizes = vec![0; members.len()];
    for index in 0..members.len() {
        sizes[root(&mut parents, index)] += 1;
    }
    sizes.into_iter().max().unwrap_or(0)
}

fn root(parents: &mut [usize], mut index: usize) -> usize {
    while parents[index] != index {
        parents[index] = parents[parents[index]];
        index = parents[index];
    }
    index
}
