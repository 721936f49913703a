//! The values of log variables. Angles are in degrees, and pitch is positive with the nose up, as ground
//! stations expect ([`LogVariable`]).

use bittybuzz_crtp::{LogVariable, SupervisorInfo, Value, pack_quaternion};
use bittybuzz_flight::stack::FlightStack;
use bittybuzz_flight::{FlightState, GRAVITY_M_S2, Quat, Reference, Vec3};

use super::STATE;
use crate::decks::fault::Direction;
use crate::decks::ranging;
use crate::flight::{pilot_desk, state};
use crate::motors;

/// The voltages of an empty and a full battery in mV, between which its level is counted.
const EMPTY_MV: u16 = 3000;
const FULL_MV: u16 = 4200;
/// The range variables without a measurement (zranger2.c, multiranger.c).
const NO_RANGE_MM: u32 = 32_767;

/// Returns the value of a variable.
pub fn value(variable: LogVariable, info: &SupervisorInfo) -> Value {
    let of_stack = |read: fn(&FlightStack, LogVariable) -> f32| {
        let number = pilot_desk::look(|stack| (read(stack, variable), false));
        Value::Float(number.unwrap_or(0.0))
    };
    let battery_mv = STATE.battery_mv().unwrap_or(0);
    use LogVariable as V;
    match variable {
        V::KalmanVarX
        | V::KalmanVarY
        | V::KalmanVarZ
        | V::KalmanVarPx
        | V::KalmanVarPy
        | V::KalmanVarPz => of_stack(variance),
        V::GyroX | V::GyroY | V::GyroZ | V::AccX | V::AccY | V::AccZ => {
            Value::Float(inertia(variable))
        }
        V::BaroAsl | V::BaroTemp | V::BaroPressure => Value::Float(air(variable)),
        V::MotorM1 | V::MotorM2 | V::MotorM3 | V::MotorM4 => {
            let number = variable as usize - V::MotorM1 as usize;
            Value::Unsigned(motors::duties().get(number).copied().unwrap_or(0).into())
        }
        V::PmVbat => Value::Float(f32::from(battery_mv) / 1000.0),
        V::PmVbatMv => Value::Unsigned(battery_mv.into()),
        // On battery, or charging (pm.h).
        V::PmState => Value::Signed(STATE.is_usb_powered().into()),
        V::PmBatteryLevel => {
            let share = u32::from(battery_mv.saturating_sub(EMPTY_MV)) * 10;
            Value::Unsigned((share / u32::from(FULL_MV - EMPTY_MV) * 10).min(100))
        }
        V::SupervisorInfo => Value::Unsigned(info.bits().into()),
        V::SysCanFly => Value::Unsigned(info.can_fly.into()),
        V::SysIsFlying => Value::Unsigned(info.is_flying.into()),
        V::SysIsTumbled => Value::Unsigned(info.is_tumbled.into()),
        // The strength is a positive number of -dBm.
        V::RadioRssi => Value::Unsigned(STATE.rssi().unsigned_abs().into()),
        V::RadioIsConnected => Value::Unsigned(1),
        V::RadioNumRxBc => Value::Unsigned(STATE.heard() & 0xffff),
        V::RadioNumRxUc => Value::Unsigned(STATE.received() & 0xffff),
        V::RangeFront => range(Direction::Front),
        V::RangeBack => range(Direction::Back),
        V::RangeUp => range(Direction::Up),
        V::RangeLeft => range(Direction::Left),
        V::RangeRight => range(Direction::Right),
        V::RangeZ => range(Direction::Down),
        V::StateEstimateZX
        | V::StateEstimateZY
        | V::StateEstimateZZ
        | V::StateEstimateZVx
        | V::StateEstimateZVy
        | V::StateEstimateZVz => {
            let meters = of_stack(small);
            Value::Signed((meters.as_f32() * 1000.0) as i32)
        }
        V::StateEstimateZQuat => {
            let quaternion = pilot_desk::look(|stack| (stack.state().attitude.to_array(), false));
            Value::Unsigned(pack_quaternion(quaternion.unwrap_or_default()))
        }
        V::TargetX
        | V::TargetY
        | V::TargetZ
        | V::TargetVx
        | V::TargetVy
        | V::TargetVz
        | V::TargetRoll
        | V::TargetPitch
        | V::TargetYaw => of_stack(target),
        _ => of_stack(estimate),
    }
}

/// Returns an axis of a vector.
fn axis(vector: Vec3, variable: LogVariable, first: LogVariable) -> f32 {
    let number = (variable as usize).wrapping_sub(first as usize);
    vector.to_array().get(number).copied().unwrap_or(0.0)
}

fn target(stack: &FlightStack, variable: LogVariable) -> f32 {
    use LogVariable as V;
    let Some(Reference { position_m, velocity_m_s, yaw_rad, .. }) = stack.reference() else {
        return 0.0;
    };
    match variable {
        V::TargetX | V::TargetY | V::TargetZ => axis(position_m, variable, V::TargetX),
        V::TargetVx | V::TargetVy | V::TargetVz => axis(velocity_m_s, variable, V::TargetVx),
        V::TargetYaw => yaw_rad.to_degrees(),
        _ => 0.0,
    }
}

fn small(stack: &FlightStack, variable: LogVariable) -> f32 {
    use LogVariable as V;
    let FlightState { position_m, velocity_m_s, .. } = stack.state();
    match variable {
        V::StateEstimateZX | V::StateEstimateZY | V::StateEstimateZZ => {
            axis(position_m, variable, V::StateEstimateZX)
        }
        _ => axis(velocity_m_s, variable, V::StateEstimateZVx),
    }
}

fn variance(stack: &FlightStack, variable: LogVariable) -> f32 {
    // The order of the states is that of the variables: position, then velocity.
    let number = (variable as usize).wrapping_sub(LogVariable::KalmanVarX as usize);
    let covariance = stack.covariance();
    covariance.get(number).and_then(|row| row.get(number)).copied().unwrap_or(0.0)
}

fn estimate(stack: &FlightStack, variable: LogVariable) -> f32 {
    use LogVariable as V;
    let FlightState { position_m, velocity_m_s, attitude, .. } = stack.state();
    let Quat { x, y, z, w } = attitude;
    let roll = || libm_degrees(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z);
    let pitch = || {
        let sine = 2.0 * (x * z - w * y);
        libm_degrees(
            sine,
            Vec3::new(w * w + x * x - y * y - z * z, 2.0 * (w * z + x * y), 0.0).length(),
        )
    };
    let yaw = || libm_degrees(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
    match variable {
        V::StateEstimateX | V::StateEstimateY | V::StateEstimateZ => {
            axis(position_m, variable, V::StateEstimateX)
        }
        V::KalmanStateX | V::KalmanStateY | V::KalmanStateZ => {
            axis(position_m, variable, V::KalmanStateX)
        }
        V::LocSrvX | V::LocSrvY | V::LocSrvZ => axis(position_m, variable, V::LocSrvX),
        V::StateEstimateVx | V::StateEstimateVy | V::StateEstimateVz => {
            axis(velocity_m_s, variable, V::StateEstimateVx)
        }
        // These are in the frame of the body (estimator_kalman.c).
        V::KalmanStatePx | V::KalmanStatePy | V::KalmanStatePz => {
            axis(attitude.conjugate() * velocity_m_s, variable, V::KalmanStatePx)
        }
        // In g, in the world and without gravity (stateEstimate.az, estimator_kalman.c).
        V::StateEstimateAx | V::StateEstimateAy | V::StateEstimateAz => {
            let Some(sample) = state::last_sample() else { return 0.0 };
            let force = Vec3::from_array(sample.acceleration.m_per_s2) / GRAVITY_M_S2;
            axis(attitude * force - Vec3::Z, variable, V::StateEstimateAx)
        }
        V::StateEstimateRoll | V::StabilizerRoll => roll(),
        V::StateEstimatePitch | V::StabilizerPitch => pitch(),
        V::StateEstimateYaw | V::StabilizerYaw => yaw(),
        V::StateEstimateQx | V::LocSrvQx | V::KalmanQ1 => x,
        V::StateEstimateQy | V::LocSrvQy | V::KalmanQ2 => y,
        V::StateEstimateQz | V::LocSrvQz | V::KalmanQ3 => z,
        V::StateEstimateQw | V::LocSrvQw | V::KalmanQ0 => w,
        // The mean of the motors (0 to 65,535), as `thrust` of Bitcraze's firmware.
        V::StabilizerThrust => {
            motors::duties().iter().map(|duty| f32::from(*duty)).sum::<f32>() / 4.0
        }
        _ => 0.0,
    }
}

/// Returns the angle of a vector in degrees.
fn libm_degrees(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x).to_degrees()
}

fn inertia(variable: LogVariable) -> f32 {
    use LogVariable as V;
    let Some(sample) = state::last_sample() else { return 0.0 };
    match variable {
        V::GyroX | V::GyroY | V::GyroZ => {
            axis(Vec3::from_array(sample.rate.rad_per_s), variable, V::GyroX).to_degrees()
        }
        _ => axis(Vec3::from_array(sample.acceleration.m_per_s2), variable, V::AccX) / GRAVITY_M_S2,
    }
}

fn air(variable: LogVariable) -> f32 {
    let Some(sample) = state::last_air() else { return 0.0 };
    match variable {
        LogVariable::BaroPressure => sample.air.pressure_pa / 100.0,
        LogVariable::BaroTemp => sample.air.temperature_celsius,
        _ => 0.0,
    }
}

fn range(direction: Direction) -> Value {
    let sample = ranging::last_sample(direction);
    let distance_m = sample.and_then(|sample| sample.distance_m.ok());
    Value::Unsigned(distance_m.map_or(NO_RANGE_MM, |m| (m * 1000.0) as u32))
}
