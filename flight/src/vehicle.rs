//! The properties of a quadrotor that estimation and control need.

use glam::Vec3;

/// The properties of one kind of quadrotor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// Mass in kg.
    pub mass_kg: f32,
    /// Principal moments of inertia about x, y and z, in kg·m².
    pub inertia_kg_m2: Vec3,
    /// Distance of each motor from the x axis, and from the y axis, in m.
    pub arm_m: f32,
    /// Torque about z per thrust of a motor, in N·m/N.
    pub torque_per_thrust_m: f32,
    /// Thrust of a motor by its voltage v: the sum of `thrust_n_v[i]` vⁱ, in N.
    pub thrust_n_v: [f32; 4],
    /// Least thrust of a motor that turns, in N.
    pub least_thrust_n: f32,
    /// Largest thrust of a motor that the controller uses, in N.
    pub most_thrust_n: f32,
    /// Time constant of the thrust in seconds while a rotor spins up.
    pub spin_up_s: f32,
    /// Time constant of the thrust in seconds while a rotor spins down.
    pub spin_down_s: f32,
    /// Moment of inertia of a rotor in kg·m².
    pub rotor_inertia_kg_m2: f32,
}

impl Vehicle {
    /// The Crazyflie 2.1+ without decks.
    ///
    /// Read: thrust by voltage, least thrust, largest thrust and torque per thrust
    /// (crazyflie-firmware 2a18fc29, `platform_defaults_cf2.h`; arm 0.046 m there, at 45 degrees); mass,
    /// moments of inertia, rotor inertia and time constants near hover (drone-models 77f04ab,
    /// `P250`; that file marks the moments of inertia as not measured for these propellers).
    pub const CRAZYFLIE_2_1_PLUS: Self = Vehicle {
        mass_kg: 0.0318,
        inertia_kg_m2: Vec3::new(16.8e-6, 16.8e-6, 29.8e-6),
        arm_m: 0.0325,
        torque_per_thrust_m: 0.006_992_89,
        thrust_n_v: [-0.024_765_4, 0.065_237_9, -0.026_792_5, 0.006_776_79],
        least_thrust_n: 0.012_817_6,
        most_thrust_n: 0.12,
        spin_up_s: 0.112,
        spin_down_s: 0.103,
        rotor_inertia_kg_m2: 26.97e-9,
    };

    /// The Crazyflie 2.1 Brushless with propeller guards.
    ///
    /// Sources as for [`Vehicle::CRAZYFLIE_2_1_PLUS`]: `platform_defaults_cf21bl.h` and `B500`.
    pub const CRAZYFLIE_BRUSHLESS: Self = Vehicle {
        mass_kg: 0.04338,
        inertia_kg_m2: Vec3::new(25e-6, 28e-6, 49e-6),
        arm_m: 0.035_355,
        torque_per_thrust_m: 0.005_692_79,
        thrust_n_v: [-0.014_058_9, 0.042_652_7, 0.001_832_78, 0.002_057_70],
        least_thrust_n: 0.021_362_6,
        most_thrust_n: 0.2,
        spin_up_s: 0.057,
        spin_down_s: 0.062,
        rotor_inertia_kg_m2: 38.93e-9,
    };
}
