//! Names of rules in earlier versions.

/// Earlier name of each renamed rule or group of rules, and its current name.
pub(crate) const RENAMED_RULES: [(&str, &str); 48] = [
    ("world.durations.gap", "world.durations.pause"),
    ("world.durations.move_away", "world.durations.retract_arm"),
    ("world.durations.refused_pick", "world.durations.refused_pick_up"),
    ("world.durations.vain_grasp", "world.durations.failed_grasp"),
    ("world.durations.watch_fall", "world.durations.max_fall_wait"),
    ("world.durations.watch_put_in", "world.durations.max_put_in_wait"),
    ("world.delivered_anywhere", "world.put_on_delivers_all_released"),
    ("world.dropped_counts", "world.failed_put_on_can_deliver"),
    ("world.tells_removed", "world.announces_removed_obstacles"),
    ("planner.around_turns", "planner.look_around_turns"),
    ("planner.goal_blackout_frames", "planner.failed_goal_place_frames"),
    ("planner.held_frames", "planner.seen_held_ignore_frames"),
    ("planner.knows_holding", "planner.knows_partner_behavior"),
    ("planner.limits", "planner.plan_timeouts"),
    ("planner.looks_around_first", "planner.initial_look_around"),
    ("planner.minds_child", "planner.supervises_child"),
    ("planner.reconsiders", "planner.replans"),
    ("planner.sees_holding", "planner.sees_held_objects"),
    ("planner.stops_turning_when_found", "planner.look_around_stops_when_found"),
    ("planner.trusts_child", "planner.leaves_returning_child"),
    ("planner.weighs_time", "planner.checks_time_to_deliver"),
    ("planner.time.partner_holds_frames", "planner.time.partner_load_valid_frames"),
    ("planner.time.reconsider_frames", "planner.time.replan_interval_frames"),
    ("planner.time.spare_frames", "planner.time.delivery_reserve_frames"),
    ("planner.time.walk_factor", "planner.time.path_time_factor"),
    ("planner.failures.bad_place_frames", "planner.failures.failed_position_frames"),
    ("planner.failures.barred_frames", "planner.failures.repeated_collision_frames"),
    ("planner.failures.held_for_sure_frames", "planner.failures.held_refusal_ignore_frames"),
    ("planner.failures.lift_tries", "planner.failures.max_failed_lifts"),
    ("planner.failures.places_tried", "planner.failures.max_positions_tried"),
    ("planner.lifting.at_piece_frames", "planner.lifting.partner_sighting_max_age_frames"),
    ("planner.lifting.at_piece_m", "planner.lifting.partner_at_furniture_m"),
    ("planner.lifting.call_frames", "planner.lifting.help_request_frames"),
    ("planner.lifting.left_piece_m", "planner.lifting.partner_left_furniture_m"),
    ("planner.lifting.tries_together", "planner.lifting.max_failed_joint_lifts"),
    ("planner.people.child_trust_frames", "planner.people.child_return_frames"),
    ("planner.child.border_m", "planner.child.bounds_margin_m"),
    ("planner.child.caught_m", "planner.child.turn_back_distance_m"),
    ("planner.child.far_m", "planner.child.far_from_guardian_m"),
    ("planner.child.follow_m", "planner.child.follow_distance_m"),
    ("planner.child.free_m", "planner.child.target_clearance_m"),
    ("planner.child.home_m", "planner.child.returned_distance_m"),
    ("planner.child.off_far_rad", "planner.child.escape_min_angle_far_rad"),
    ("planner.child.off_rad", "planner.child.escape_min_angle_rad"),
    ("planner.child.plan_frames", "planner.child.decision_interval_frames"),
    ("planner.child.run_chance", "planner.child.escape_probability"),
    ("planner.child.run_min_m", "planner.child.escape_min_m"),
    ("planner.child.there_m", "planner.child.arrival_distance_m"),
];

/// Returns the current name of a rule of an earlier version.
pub(crate) fn current_name(name: &str) -> Option<String> {
    RENAMED_RULES.iter().find_map(|(old, new)| {
        let rest = name.strip_prefix(old)?;
        (rest.is_empty() || rest.starts_with('.')).then(|| format!("{new}{rest}"))
    })
}
