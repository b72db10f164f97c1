//! Joint positions of a body.

use chaic_core::Vec3;
use chaic_core::capability::{Impairment, Persona};
use chaic_core::geom::math;
use chaic_world::Posture;
use glam::Mat3;

use super::proportions::BodyProportions;
use crate::mesh::{length, unit};

/// Distance of one gait cycle of an adult, meters.
const STRIDE_M: f32 = 1.3;
/// Radius of a wheelchair's large wheels, and position of their axle in the body frame, meters.
pub(super) const WHEEL_RADIUS_M: f32 = 0.30;
pub(super) const WHEEL_X_M: f32 = 0.27;
pub(super) const AXLE_Z_M: f32 = 0.12;

/// Joints in the body frame (x right, y up, -z forward, origin between the feet), meters. Pairs are
/// left and right.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skeleton {
    pub hips: Vec3,
    /// Center between the shoulders.
    pub chest: Vec3,
    /// Columns: right, up and back of the trunk.
    pub trunk: Mat3,
    pub head: Vec3,
    /// Columns: right, up and back of the head.
    pub head_axes: Mat3,
    pub shoulders: [Vec3; 2],
    pub elbows: [Vec3; 2],
    pub hands: [Vec3; 2],
    pub grips: [bool; 2],
    pub hip_joints: [Vec3; 2],
    pub knees: [Vec3; 2],
    pub ankles: [Vec3; 2],
    /// Downward pitch of the feet, radians.
    pub foot_pitch: [f32; 2],
    /// True if the face shows a failing effort.
    pub effort: bool,
    /// True if the left arm is in a sling.
    pub sling: bool,
    /// Handle and tip of a white cane.
    pub cane: Option<[Vec3; 2]>,
}

/// Distance of one gait cycle for an adult's height, meters. Frail people take short steps.
fn stride_m(posture: &Posture) -> f32 {
    let rested_m = match posture.persona {
        Persona::Frail => 0.62 * STRIDE_M,
        Persona::Child => 0.9 * STRIDE_M,
        _ => STRIDE_M,
    };
    rested_m * (1.0 - 0.35 * posture.fatigue)
}

/// Current displacement of the hands by tremor, meters.
fn tremor_m(posture: &Posture, frame: u32) -> f32 {
    let swing = || math::sin(2.1 * (frame % 10_000) as f32);
    if posture.impairments.has(Impairment::Tremor) { 0.022 * swing() } else { 0.0 }
}

/// Handle and tip of a swinging cane, for a person with low vision and a free right hand.
fn cane(posture: &Posture, right_hand: Vec3, phase: f32, in_wheelchair: bool) -> Option<[Vec3; 2]> {
    let is_hanging = posture.arms[1].hand_in_body.y < 0.5 * posture.height_m;
    let is_hand_free = !posture.arms[1].grips && is_hanging && posture.bend < 0.3;
    let has_low_vision = posture.impairments.has(Impairment::LowVision);
    (has_low_vision && is_hand_free && !in_wheelchair).then(|| {
        let h = posture.height_m;
        let swing = if posture.moving { 0.16 * h * math::sin(phase) } else { 0.0 };
        [right_hand, Vec3::new(swing + 0.04 * h, 0.01, right_hand.z - 0.52 * h)]
    })
}

/// Drop of the hips while walking, relative to the standing height, as a fraction of the height. It
/// has two maxima per gait cycle, when both feet are on the ground.
fn hip_drop(posture: &Posture, phase: f32) -> f32 {
    let sink = 0.5 - 0.5 * math::cos(2.0 * phase);
    match posture.persona {
        // A limp: the body drops onto one leg.
        Persona::Frail => 0.008 + 0.016 * (0.5 + 0.5 * math::cos(phase)),
        Persona::Child => 0.004 + 0.022 * sink,
        _ => 0.006 + 0.012 * sink,
    }
}

/// Lean of the trunk over the standing leg, radians.
fn sway_rad(posture: &Posture, phase: f32) -> f32 {
    let amplitude = match posture.persona {
        Persona::Frail => 0.11,
        Persona::Child => 0.05,
        _ => 0.03,
    };
    let offset = if posture.persona == Persona::Frail { 0.05 } else { 0.0 };
    amplitude * math::cos(phase) + offset
}

/// Frame that leans forward by `pitch` and to the right by `roll`.
fn leaning(pitch: f32, roll: f32) -> Mat3 {
    let (sp, cp) = (math::sin(pitch), math::cos(pitch));
    let (sr, cr) = (math::sin(roll), math::cos(roll));
    let (up, back) = (Vec3::new(0.0, cp, -sp), Vec3::new(0.0, sp, cp));
    let (right, up) = (Vec3::X * cr - up * sr, up * cr + Vec3::X * sr);
    Mat3::from_cols(right, up, back)
}

/// Two-bone inverse kinematics: middle joint and end of a limb that reaches for `target`, bent
/// toward `pole`. Bones stretch a little before they miss the target.
fn two_bone_ik(root: Vec3, target: Vec3, bones: [f32; 2], pole: Vec3) -> (Vec3, Vec3) {
    const MAX_STRETCH: f32 = 1.18;
    let to_target = target - root;
    let distance = length(to_target).max(1e-3);
    let dir = to_target / distance;
    let full = bones[0] + bones[1];
    let reach = distance.min(MAX_STRETCH * full);
    let stretch = (reach / full).max(1.0);
    let (a, b) = (bones[0] * stretch, bones[1] * stretch);
    let reach = reach.max((a - b).abs() * 1.05 + 1e-3);
    let along = (a * a - b * b + reach * reach) / (2.0 * reach);
    let out = (a * a - along * along).max(0.0).sqrt();
    let side = unit(pole - dir * pole.dot(dir));
    (root + dir * along + side * out, root + dir * reach)
}

impl Skeleton {
    /// Bounding box of body and clothes, meters: the extent around each joint, with a few
    /// centimeters of margin.
    pub fn bounds(&self, b: &BodyProportions) -> (Vec3, Vec3) {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut extend = |joint: Vec3, reach_m: f32| {
            (min, max) = (min.min(joint - reach_m), max.max(joint + reach_m));
        };
        if let Some([handle, tip]) = self.cane {
            extend(handle, 0.02);
            extend(tip, 0.02);
        }
        if self.sling {
            extend(self.elbows[0], 0.15 * b.girth);
        }
        extend(self.hips, b.shoulder_x + 0.06);
        extend(self.chest, b.shoulder_x + 0.08);
        extend(self.head, 0.80 * b.head + 0.05);
        for k in 0..2 {
            extend(self.shoulders[k], 0.10 * b.girth);
            extend(self.elbows[k], 0.09 * b.girth);
            extend(self.hands[k], 0.12 * b.girth);
            extend(self.knees[k], 0.12 * b.girth);
            extend(self.ankles[k], 0.22 * b.girth);
        }
        (min, max)
    }

    pub fn new(
        posture: &Posture,
        proportions: &BodyProportions,
        in_wheelchair: bool,
        frame: u32,
    ) -> Skeleton {
        let (bend, stretch) = (posture.bend, posture.stretch);
        let h = proportions.top_y;
        let tremor =
            if posture.failing { 0.02 * math::sin(2.1 * (frame % 10_000) as f32) } else { 0.0 };
        let phase = std::f32::consts::TAU * posture.walked_m / (stride_m(posture) * h / 1.75);
        let walks = posture.moving && !in_wheelchair;
        let (mut hips, pitch) = if in_wheelchair {
            (Vec3::new(0.0, 0.56, 0.06), proportions.lean_rad - 0.06 + 0.95 * bend)
        } else {
            let low = if walks { hip_drop(posture, phase) * h } else { 0.0 };
            let y = proportions.hip_y + (0.20 * h - proportions.hip_y) * bend - low
                + 0.05 * h * stretch;
            (Vec3::new(0.0, y, 0.10 * h * bend), proportions.lean_rad + 1.0 * bend)
        };
        // A tired person stoops.
        let pitch = pitch + 0.3 * posture.fatigue;
        hips.x += tremor;
        let roll = if walks { sway_rad(posture, phase) } else { 0.0 };
        hips.x += 0.25 * roll;
        let trunk = leaning(pitch, roll);
        let chest = hips + trunk.y_axis * (proportions.shoulder_y - proportions.hip_y);
        let tilt = if posture.failing { 0.28 + 2.0 * tremor } else { 0.0 };
        let tremor = tremor + tremor_m(posture, frame);
        // A person with low vision looks at the ground ahead.
        let lowered = if posture.impairments.has(Impairment::LowVision) { 0.4 } else { 0.0 };
        let head_axes = leaning(
            0.45 * pitch + lowered - 0.35 * stretch + if posture.failing { 0.3 } else { 0.0 },
            tilt,
        );
        let neck = proportions.top_y - proportions.shoulder_y - 0.5 * proportions.head;
        let head = chest + (0.5 * (trunk.y_axis + head_axes.y_axis)) * neck;

        let mut s = Skeleton {
            hips,
            chest,
            trunk,
            head,
            head_axes,
            shoulders: [chest; 2],
            elbows: [chest; 2],
            hands: [chest; 2],
            grips: posture.arms.map(|a| a.grips),
            hip_joints: [hips; 2],
            knees: [hips; 2],
            ankles: [hips; 2],
            foot_pitch: [0.0; 2],
            effort: posture.failing,
            sling: posture.impairments.has(Impairment::OneHanded),
            cane: None,
        };
        for (k, side) in [-1.0f32, 1.0].into_iter().enumerate() {
            let cycle = phase + std::f32::consts::PI * k as f32;
            s.place_leg(
                k,
                side,
                proportions,
                in_wheelchair,
                if walks { Some(cycle) } else { None },
                posture,
            );
            s.place_arm(k, side, proportions, in_wheelchair, cycle, posture, tremor);
        }
        s.cane = cane(posture, s.hands[1], phase, in_wheelchair);
        s
    }

    fn place_leg(
        &mut self,
        k: usize,
        side: f32,
        b: &BodyProportions,
        in_wheelchair: bool,
        cycle: Option<f32>,
        posture: &Posture,
    ) {
        self.hip_joints[k] = self.hips + Vec3::X * (side * b.hip_x);
        if in_wheelchair {
            let x = side * (b.hip_x + 0.035);
            let ankle = Vec3::new(x, 0.17, -0.46);
            (self.knees[k], self.ankles[k]) = two_bone_ik(
                self.hip_joints[k],
                ankle,
                [b.thigh, b.shin],
                Vec3::new(0.0, 1.0, -0.6),
            );
            return;
        }
        let mut ankle = Vec3::new(side * 1.25 * b.hip_x, b.ankle_y, 0.0);
        // In a kneeling pose, one foot is forward.
        ankle.z += posture.bend * b.top_y * if k == 0 { -0.10 } else { 0.08 };
        ankle.y += 0.05 * b.top_y * posture.stretch;
        self.foot_pitch[k] = 0.7 * posture.stretch + if k == 1 { 0.8 * posture.bend } else { 0.0 };
        if k == 1 {
            ankle.y += 0.035 * b.top_y * posture.bend;
        }
        if let Some(cycle) = cycle {
            let half_step = 0.25 * stride_m(posture) * b.top_y / 1.75;
            let (sn, cs) = (math::sin(cycle), math::cos(cycle));
            ankle.z -= half_step * sn;
            ankle.y += 0.075 * b.top_y * cs.max(0.0) * (1.0 - 0.4 * sn);
            self.foot_pitch[k] += 0.55 * (cs - 0.35 * sn).max(0.0) - 0.25 * sn.max(0.0);
        }
        (self.knees[k], self.ankles[k]) = two_bone_ik(
            self.hip_joints[k],
            ankle,
            [b.thigh, b.shin],
            Vec3::new(0.08 * side, 0.0, -1.0),
        );
    }

    #[allow(clippy::too_many_arguments, reason = "one call, one posture taken apart")]
    fn place_arm(
        &mut self,
        k: usize,
        side: f32,
        b: &BodyProportions,
        in_wheelchair: bool,
        cycle: f32,
        posture: &Posture,
        tremor: f32,
    ) {
        let shoulder = self.chest + self.trunk.x_axis * (side * b.shoulder_x)
            - self.trunk.y_axis * (0.022 * b.top_y)
            + Vec3::Y * (0.015 * b.top_y * posture.stretch);
        self.shoulders[k] = shoulder;
        let mut target = posture.arms[k].hand_in_body;
        let is_in_sling = k == 0 && self.sling;
        if is_in_sling {
            let (front, down) = (-self.trunk.z_axis, -self.trunk.y_axis);
            target = self.chest + front * (0.13 * b.top_y) + down * (0.15 * b.top_y);
        }
        let is_hanging = !is_in_sling
            && !posture.arms[k].grips
            && target.y < b.hip_y + 0.12
            && posture.bend < 0.3;
        if in_wheelchair && !is_in_sling && !posture.arms[k].grips && (posture.moving || is_hanging)
        {
            // The hands push the rims forward and return above them.
            let push = if posture.moving {
                math::sin(posture.walked_m / (2.0 * WHEEL_RADIUS_M) * 3.0)
            } else {
                0.2
            };
            let a = 0.55 * push;
            target = Vec3::new(
                side * (WHEEL_X_M + 0.01),
                WHEEL_RADIUS_M + (WHEEL_RADIUS_M + 0.03) * math::cos(a),
                AXLE_Z_M - (WHEEL_RADIUS_M + 0.03) * math::sin(a),
            );
        } else if posture.moving && is_hanging && !in_wheelchair {
            target.z += 0.13 * b.top_y / 1.75 * math::sin(cycle);
        }
        if posture.failing && !posture.arms[k].grips {
            target.y -= 0.05 * b.top_y;
        }
        let has_tremor = posture.impairments.has(Impairment::Tremor);
        if posture.persona == Persona::Frail || posture.failing || has_tremor {
            target += Vec3::new(tremor, 0.7 * tremor, 0.0);
        }
        let pole = Vec3::new(0.55 * side, -0.6, 0.7);
        (self.elbows[k], self.hands[k]) =
            two_bone_ik(shoulder, target, [b.upper_arm, b.forearm + 0.03], pole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_reaches_its_target_with_constant_bone_lengths() {
        let (root, target) = (Vec3::new(0.2, 1.4, 0.0), Vec3::new(0.3, 1.1, -0.3));
        let (elbow, hand) = two_bone_ik(root, target, [0.3, 0.28], Vec3::new(0.5, -0.6, 0.7));
        assert!(length(hand - target) < 1e-5);
        assert!((length(elbow - root) - 0.3).abs() < 1e-4);
        assert!((length(hand - elbow) - 0.28).abs() < 1e-4);
        let (_, far) = two_bone_ik(root, Vec3::new(9.0, 9.0, 9.0), [0.3, 0.28], Vec3::Y);
        assert!(length(far - root) < 0.7, "an arm has a limited length");
    }
}
