//! Where the joints of a body are.

use chaic_core::Vec3;
use chaic_core::capability::{Impairment, Persona};
use chaic_core::geom::math;
use chaic_world::Posture;
use glam::Mat3;

use super::build::Build;
use crate::mesh::{length, unit};

/// Distance an adult covers in one cycle of both legs, metres.
const STRIDE_M: f32 = 1.3;
/// Radius of a wheelchair's large wheels, and where their axle is in the body's frame, metres.
pub(super) const WHEEL_RADIUS_M: f32 = 0.30;
pub(super) const WHEEL_X_M: f32 = 0.27;
pub(super) const AXLE_Z_M: f32 = 0.12;

/// Joints in the body's frame (x right, y up, -z ahead, origin between the feet), metres. Pairs
/// are left and right.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skeleton {
    pub hips: Vec3,
    /// Middle between the shoulders.
    pub chest: Vec3,
    /// Columns: the trunk's right, up and back.
    pub trunk: Mat3,
    pub head: Vec3,
    /// Columns: the head's right, up and back.
    pub head_axes: Mat3,
    pub shoulders: [Vec3; 2],
    pub elbows: [Vec3; 2],
    pub hands: [Vec3; 2],
    pub grips: [bool; 2],
    pub hip_joints: [Vec3; 2],
    pub knees: [Vec3; 2],
    pub ankles: [Vec3; 2],
    /// How far the feet point down, radians.
    pub foot_pitch: [f32; 2],
    /// Whether the face shows an effort that fails.
    pub effort: bool,
    /// Whether the left arm is in a sling.
    pub sling: bool,
    /// Handle and tip of a white cane.
    pub cane: Option<[Vec3; 2]>,
}

/// Distance that this person covers in one cycle of both legs, metres for an adult's height: the
/// frail take short steps.
fn stride_m(posture: &Posture) -> f32 {
    let rested_m = match posture.persona {
        Persona::Frail => 0.62 * STRIDE_M,
        Persona::Child => 0.9 * STRIDE_M,
        _ => STRIDE_M,
    };
    rested_m * (1.0 - 0.35 * posture.fatigue)
}

/// How far the hands of this person tremble now, metres.
fn tremor_m(posture: &Posture, frame: u32) -> f32 {
    let swing = || math::sin(2.1 * (frame % 10_000) as f32);
    if posture.impairments.has(Impairment::Tremor) { 0.022 * swing() } else { 0.0 }
}

/// Handle and tip of the cane that somebody swings to and fro who sees little and has a free hand.
fn cane(posture: &Posture, right_hand: Vec3, phase: f32, rolls: bool) -> Option<[Vec3; 2]> {
    let hangs = posture.arms[1].hand_in_body.y < 0.5 * posture.height_m;
    let is_free = !posture.arms[1].grips && hangs && posture.bend < 0.3;
    let sees_little = posture.impairments.has(Impairment::LowVision);
    (sees_little && is_free && !rolls).then(|| {
        let h = posture.height_m;
        let swing = if posture.moving { 0.16 * h * math::sin(phase) } else { 0.0 };
        [right_hand, Vec3::new(swing + 0.04 * h, 0.01, right_hand.z - 0.52 * h)]
    })
}

/// How much lower the hips are in the middle of a walk than when standing, as a fraction of the
/// height: they sink twice in a cycle, when both feet are on the ground.
fn low_when_walking(posture: &Posture, phase: f32) -> f32 {
    let sunk = 0.5 - 0.5 * math::cos(2.0 * phase);
    match posture.persona {
        // A limp: the body drops onto one leg.
        Persona::Frail => 0.008 + 0.016 * (0.5 + 0.5 * math::cos(phase)),
        Persona::Child => 0.004 + 0.022 * sunk,
        _ => 0.006 + 0.012 * sunk,
    }
}

/// How far the trunk leans over the standing leg, radians.
fn sway_rad(posture: &Posture, phase: f32) -> f32 {
    let most = match posture.persona {
        Persona::Frail => 0.11,
        Persona::Child => 0.05,
        _ => 0.03,
    };
    let lopsided = if posture.persona == Persona::Frail { 0.05 } else { 0.0 };
    most * math::cos(phase) + lopsided
}

/// A frame that leans forward by `pitch` and to the right by `roll`.
fn leaning(pitch: f32, roll: f32) -> Mat3 {
    let (sp, cp) = (math::sin(pitch), math::cos(pitch));
    let (sr, cr) = (math::sin(roll), math::cos(roll));
    let (up, back) = (Vec3::new(0.0, cp, -sp), Vec3::new(0.0, sp, cp));
    let (right, up) = (Vec3::X * cr - up * sr, up * cr + Vec3::X * sr);
    Mat3::from_cols(right, up, back)
}

/// The middle joint and the end of a limb of two bones that reaches for `target`, bending towards
/// `pole`. Bones give a little rather than miss.
fn two_bones(root: Vec3, target: Vec3, bones: [f32; 2], pole: Vec3) -> (Vec3, Vec3) {
    const GIVE: f32 = 1.18;
    let way = target - root;
    let distance = length(way).max(1e-3);
    let dir = way / distance;
    let full = bones[0] + bones[1];
    let reach = distance.min(GIVE * full);
    let stretch = (reach / full).max(1.0);
    let (a, b) = (bones[0] * stretch, bones[1] * stretch);
    let reach = reach.max((a - b).abs() * 1.05 + 1e-3);
    let along = (a * a - b * b + reach * reach) / (2.0 * reach);
    let out = (a * a - along * along).max(0.0).sqrt();
    let side = unit(pole - dir * pole.dot(dir));
    (root + dir * along + side * out, root + dir * reach)
}

impl Skeleton {
    /// A box around all flesh and clothes, metres: around a joint they reach no farther than this,
    /// with a few centimetres to spare.
    pub fn bounds(&self, b: &Build) -> (Vec3, Vec3) {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut around = |joint: Vec3, reach_m: f32| {
            (min, max) = (min.min(joint - reach_m), max.max(joint + reach_m));
        };
        if let Some([handle, tip]) = self.cane {
            around(handle, 0.02);
            around(tip, 0.02);
        }
        if self.sling {
            around(self.elbows[0], 0.15 * b.girth);
        }
        around(self.hips, b.shoulder_x + 0.06);
        around(self.chest, b.shoulder_x + 0.08);
        around(self.head, 0.80 * b.head + 0.05);
        for k in 0..2 {
            around(self.shoulders[k], 0.10 * b.girth);
            around(self.elbows[k], 0.09 * b.girth);
            around(self.hands[k], 0.12 * b.girth);
            around(self.knees[k], 0.12 * b.girth);
            around(self.ankles[k], 0.22 * b.girth);
        }
        (min, max)
    }

    pub fn of(posture: &Posture, build: &Build, rolls: bool, frame: u32) -> Skeleton {
        let (bend, stretch) = (posture.bend, posture.stretch);
        let h = build.top_y;
        let tremble =
            if posture.failing { 0.02 * math::sin(2.1 * (frame % 10_000) as f32) } else { 0.0 };
        let phase = std::f32::consts::TAU * posture.walked_m / (stride_m(posture) * h / 1.75);
        let walks = posture.moving && !rolls;
        let (mut hips, pitch) = if rolls {
            (Vec3::new(0.0, 0.56, 0.06), build.lean_rad - 0.06 + 0.95 * bend)
        } else {
            let low = if walks { low_when_walking(posture, phase) * h } else { 0.0 };
            let y = build.hip_y + (0.20 * h - build.hip_y) * bend - low + 0.05 * h * stretch;
            (Vec3::new(0.0, y, 0.10 * h * bend), build.lean_rad + 1.0 * bend)
        };
        // Who is tired stoops.
        let pitch = pitch + 0.3 * posture.fatigue;
        hips.x += tremble;
        let roll = if walks { sway_rad(posture, phase) } else { 0.0 };
        hips.x += 0.25 * roll;
        let trunk = leaning(pitch, roll);
        let chest = hips + trunk.y_axis * (build.shoulder_y - build.hip_y);
        let tilt = if posture.failing { 0.28 + 2.0 * tremble } else { 0.0 };
        let tremble = tremble + tremor_m(posture, frame);
        // Who sees little looks before the feet.
        let lowered = if posture.impairments.has(Impairment::LowVision) { 0.4 } else { 0.0 };
        let head_axes = leaning(
            0.45 * pitch + lowered - 0.35 * stretch + if posture.failing { 0.3 } else { 0.0 },
            tilt,
        );
        let neck = build.top_y - build.shoulder_y - 0.5 * build.head;
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
            s.place_leg(k, side, build, rolls, if walks { Some(cycle) } else { None }, posture);
            s.place_arm(k, side, build, rolls, cycle, posture, tremble);
        }
        s.cane = cane(posture, s.hands[1], phase, rolls);
        s
    }

    fn place_leg(
        &mut self,
        k: usize,
        side: f32,
        b: &Build,
        rolls: bool,
        cycle: Option<f32>,
        posture: &Posture,
    ) {
        self.hip_joints[k] = self.hips + Vec3::X * (side * b.hip_x);
        if rolls {
            let x = side * (b.hip_x + 0.035);
            let ankle = Vec3::new(x, 0.17, -0.46);
            (self.knees[k], self.ankles[k]) =
                two_bones(self.hip_joints[k], ankle, [b.thigh, b.shin], Vec3::new(0.0, 1.0, -0.6));
            return;
        }
        let mut ankle = Vec3::new(side * 1.25 * b.hip_x, b.ankle_y, 0.0);
        // Kneeling down, one foot comes forward.
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
        (self.knees[k], self.ankles[k]) = two_bones(
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
        b: &Build,
        rolls: bool,
        cycle: f32,
        posture: &Posture,
        tremble: f32,
    ) {
        let shoulder = self.chest + self.trunk.x_axis * (side * b.shoulder_x)
            - self.trunk.y_axis * (0.022 * b.top_y)
            + Vec3::Y * (0.015 * b.top_y * posture.stretch);
        self.shoulders[k] = shoulder;
        let mut target = posture.arms[k].hand_in_body;
        let rests = k == 0 && self.sling;
        if rests {
            let (front, down) = (-self.trunk.z_axis, -self.trunk.y_axis);
            target = self.chest + front * (0.13 * b.top_y) + down * (0.15 * b.top_y);
        }
        let hangs =
            !rests && !posture.arms[k].grips && target.y < b.hip_y + 0.12 && posture.bend < 0.3;
        if rolls && !rests && !posture.arms[k].grips && (posture.moving || hangs) {
            // Hands follow the rims forward and come back above them.
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
        } else if posture.moving && hangs && !rolls {
            target.z += 0.13 * b.top_y / 1.75 * math::sin(cycle);
        }
        if posture.failing && !posture.arms[k].grips {
            target.y -= 0.05 * b.top_y;
        }
        let trembles = posture.impairments.has(Impairment::Tremor);
        if posture.persona == Persona::Frail || posture.failing || trembles {
            target += Vec3::new(tremble, 0.7 * tremble, 0.0);
        }
        let pole = Vec3::new(0.55 * side, -0.6, 0.7);
        (self.elbows[k], self.hands[k]) =
            two_bones(shoulder, target, [b.upper_arm, b.forearm + 0.03], pole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_in_reach_gets_there_and_bones_keep_their_lengths() {
        let (root, target) = (Vec3::new(0.2, 1.4, 0.0), Vec3::new(0.3, 1.1, -0.3));
        let (elbow, hand) = two_bones(root, target, [0.3, 0.28], Vec3::new(0.5, -0.6, 0.7));
        assert!(length(hand - target) < 1e-5);
        assert!((length(elbow - root) - 0.3).abs() < 1e-4);
        assert!((length(hand - elbow) - 0.28).abs() < 1e-4);
        let (_, far) = two_bones(root, Vec3::new(9.0, 9.0, 9.0), [0.3, 0.28], Vec3::Y);
        assert!(length(far - root) < 0.7, "an arm stays an arm");
    }
}
