//! Trajectories of polynomial pieces, which a ground station writes into the robot's memory.

use crate::fields::Fields;
use crate::refusal::Refusal;

/// Pieces that the memory holds: as many as the flight controller's planner.
pub const PIECES_MAX: usize = 16;
/// Bytes of a piece: eight coefficients of x, y, z and yaw, and the duration (pptraj.h).
pub const PIECE_BYTES: usize = 4 * (4 * COEFFICIENTS + 1);
/// Bytes of the memory.
pub const TRAJECTORY_BYTES: usize = PIECES_MAX * PIECE_BYTES;
/// Coefficients of a polynomial.
const COEFFICIENTS: usize = 8;
/// Trajectories that can be defined, as many as Bitcraze's firmware has.
const DEFINITIONS: usize = 31;

/// The only place of trajectories: the memory.
const IN_MEMORY: u8 = 1;
/// The format of polynomials of degree 7.
const POLYNOMIALS: u8 = 0;
/// The format of fewer and shorter numbers.
const COMPRESSED: u8 = 1;

/// A piece of a trajectory: coefficients of powers of the time in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Coefficients of x, y and z, in m/sᵏ.
    pub position: [[f32; 3]; COEFFICIENTS],
    /// Coefficients of the yaw, in rad/sᵏ.
    pub yaw: [f32; COEFFICIENTS],
    /// The duration in seconds, more than 0.
    pub duration_s: f32,
}

/// The pieces of a trajectory in the memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredTrajectory {
    /// The address of the first piece.
    offset: u16,
    pieces: u8,
}

impl StoredTrajectory {
    /// Returns the number of pieces, at least 1.
    pub fn len(&self) -> usize {
        usize::from(self.pieces)
    }

    /// Returns true if there are no pieces, which does not happen.
    pub fn is_empty(&self) -> bool {
        self.pieces == 0
    }
}

/// The place of a trajectory, as a ground station defines it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Definition(StoredTrajectory);

impl Definition {
    /// Reads location, format, address and number of pieces.
    pub fn parse(fields: &mut Fields<'_>) -> Result<Self, Refusal> {
        let (location, format) = (fields.byte()?, fields.byte()?);
        let (offset, pieces) = (fields.u32()?, fields.byte()?);
        if location != IN_MEMORY || format > COMPRESSED {
            return Err(Refusal::Unknown);
        }
        if format != POLYNOMIALS {
            return Err(Refusal::Unsupported);
        }
        let end = u64::from(offset) + u64::from(pieces) * PIECE_BYTES as u64;
        if pieces == 0 || end > TRAJECTORY_BYTES as u64 {
            return Err(Refusal::Address);
        }
        // The end is at most the size of the memory.
        Ok(Definition(StoredTrajectory { offset: offset as u16, pieces }))
    }
}

/// The memory for trajectories, and their definitions.
#[derive(Clone, Debug)]
pub(crate) struct TrajectoryMemory {
    bytes: [u8; TRAJECTORY_BYTES],
    definitions: [Option<Definition>; DEFINITIONS],
}

impl TrajectoryMemory {
    pub const fn new() -> Self {
        TrajectoryMemory { bytes: [0; TRAJECTORY_BYTES], definitions: [None; DEFINITIONS] }
    }

    pub fn define(&mut self, id: u8, definition: Definition) -> Result<(), Refusal> {
        let slot = self.definitions.get_mut(usize::from(id)).ok_or(Refusal::NoTrajectory)?;
        *slot = Some(definition);
        Ok(())
    }

    /// Returns a defined trajectory after a look at all its pieces.
    pub fn find(&self, id: u8) -> Result<StoredTrajectory, Refusal> {
        let definition = self.definitions.get(usize::from(id)).copied().flatten();
        let Definition(trajectory) = definition.ok_or(Refusal::NoTrajectory)?;
        for number in 0..trajectory.len() {
            self.piece(&trajectory, number)?;
        }
        Ok(trajectory)
    }

    pub fn piece(&self, trajectory: &StoredTrajectory, number: usize) -> Result<Piece, Refusal> {
        if number >= trajectory.len() {
            return Err(Refusal::NoTrajectory);
        }
        let start = usize::from(trajectory.offset) + number * PIECE_BYTES;
        let bytes = self.bytes.get(start..start + PIECE_BYTES).ok_or(Refusal::Address)?;
        let mut fields = Fields::new(bytes);
        let mut position = [[0.0; 3]; COEFFICIENTS];
        for axis in 0..3 {
            for coefficients in &mut position {
                if let Some(coefficient) = coefficients.get_mut(axis) {
                    *coefficient = fields.number()?;
                }
            }
        }
        let mut yaw = [0.0; COEFFICIENTS];
        for coefficient in &mut yaw {
            *coefficient = fields.number()?;
        }
        let duration_s = fields.seconds()?;
        if duration_s > 0.0 {
            Ok(Piece { position, yaw, duration_s })
        } else {
            Err(Refusal::OutOfRange)
        }
    }

    pub fn read(&self, address: u32, length: usize) -> Result<&[u8], Refusal> {
        let start = usize::try_from(address).map_err(|_| Refusal::Address)?;
        let end = start.checked_add(length).ok_or(Refusal::Address)?;
        self.bytes.get(start..end).ok_or(Refusal::Address)
    }

    pub fn write(&mut self, address: u32, data: &[u8]) -> Result<(), Refusal> {
        let start = usize::try_from(address).map_err(|_| Refusal::Address)?;
        let end = start.checked_add(data.len()).ok_or(Refusal::Address)?;
        let bytes = self.bytes.get_mut(start..end).ok_or(Refusal::Address)?;
        bytes.iter_mut().zip(data).for_each(|(slot, byte)| *slot = *byte);
        Ok(())
    }
}
