// Steps slings through a schedule. A step solves, for the unknowns x of all sections at once,
//
//   M (x - xh)/(beta h)^2 + c M x' + dW/dx + dD/dx' = 0,   x' = (x - y)/(beta h),
//   y = x_n + past (x_n - x_n-1),   xh = y + beta h (v_n + past (v_n - v_n-1)) + (beta h)^2 gravity
//
// with the air's drag c on the nodes (not on directors or the projectile), linear and a cylinder's
// (backward Euler: beta = 1, past = 0; variable-step BDF2 otherwise) by Newton's method with the exact Hessian;
// where that is indefinite, its diagonal is shifted.

const scalar close = sqrt(0.25 * tolerance * shortest);  // from here on Newton's next change is below the tolerance
// a residual that counts for nothing [N]: by default 3 % of a node's weight, and what a strain of 1e-5 takes
const real balance = tolerance * ((scalar)1.5e4 * node_mass * gravity + (scalar)5 * mu * area);
real offset[3] = {zero, zero, zero}, pull = zero, held[3] = {zero, zero, zero};  // of the hand; the force on it when it last held
real contact_before = zero, lowest = zero + (scalar)1e30;                        // of the pouch, and its least height
real given[3] = {zero, zero, zero}, owed[3] = {zero, zero, zero}, relaxed = one;  // an arm that gives way
real force[3];                                                                   // of the band on the hand
int iterations = 0;

// The hand takes hold of the band where it is, and leads it to its own path, to `target`
auto lead_hand = [&](const scalar* row, real (&target)[3]) {
  const int grip = (int)row[STEP_GRIP];
  const bool was_attached = attached;
  gripped = grip == GRIP_HELD; attached = gripped || grip == GRIP_POUCH; opening = grip == GRIP_OPENING;
  // an arm that gives way rests where its spring holds the force: a fixed point, by Aitken's relaxation
  if (row[STEP_COMPLIANCE] > 0) {
    real turn = zero, size = zero;
    UNROLL for (int c = 0; c < 3; ++c) {
      const real owes = row[STEP_COMPLIANCE] * held[c] - given[c], change = owes - owed[c];
      turn -= owed[c] * change; size += change * change; owed[c] = owes;
    }
    relaxed = minimum(maximum(relaxed * turn / maximum(size, zero + (scalar)1e-16), zero + (scalar)0.05), one);
    UNROLL for (int c = 0; c < 3; ++c) given[c] += relaxed * owed[c];
  }
  UNROLL for (int c = 0; c < 3; ++c) {
    const scalar place = row[STEP_TARGET + c];
    if (attached && !was_attached) offset[c] = LAST(c, MIDDLE) - place;
    target[c] = given[c] + place + row[STEP_BLEND] * offset[c];
  }
  // what the pads can hold: all of it while they are closed, then less and less of the pull at the release
  capacity = opening ? maximum(pull - row[STEP_GRIP_FORCE] * friction, zero) : row[STEP_GRIP_FORCE] * friction;
};

// The predicted state, and what the step starts from
auto predict = [&](const scalar* row, const real (&target)[3]) {
  const scalar h = row[STEP_H], past = row[STEP_PAST], bh = row[STEP_BETA] * h;
  for (int i = member; i < SECTIONS; i += TEAM) UNROLL for (int k = 0; k < DOFS; ++k) {
    const real x1 = LAST(k, i), v1 = LAST_RATE(k, i), y = x1 + past * (x1 - LAST_BUT_ONE(k, i));
    const bool led = k < 3 && i == MIDDLE && attached;
    const real x = led ? target[k < 3 ? k : 0] : moves(i, k) ? x1 + h * v1 : x1;
    NOW(k, i) = x; PREDICTED(k, i) = x; FROM(k, i) = y;
    INERTIAL(k, i) = y + bh * (v1 + past * (v1 - RATE_BEFORE(k, i))) - (k == 2 ? gravity * bh * bh : (scalar)0);
  }
};

// Regularised Newton's method with a Hessian that may be frozen: (H + shift I) change = residual
//
//   fresh    H is of this iterate. Where it is indefinite, or its step goes far, the step is rejected and the
//            diagonal is shifted more (Levenberg), else less. Convergence is quadratic: a change c leaves one of some c^2.
//   frozen   H is that of the iterate before (the chord method; Kelley, Solving Nonlinear Equations with Newton's Method,
//            2003). Convergence is linear: two changes c0, c1 leave c1^2 / (c0 - c1). A step that does not halve the
//            last change, or follows one that was cut, is rejected.
//
// Slings that have settled stay as they are, so that one never depends on its neighbours. Returns the iterations.
auto newton = [&](real (&reaction)[3]) INLINED -> int {
  real settled = outcome != zero ? one : zero;
  real last_change = zero, full_step = zero;  // of the step before: its size, and whether it was made whole
  int iteration = 0;
  shift = zero;
  while (iteration < max_iterations) {
    fresh = !REUSES_FACTORS || iteration % 2 == 0 || iteration > 6;  // a frozen one costs half; a hard step has all fresh
    ++iteration;
    solve();
    real rejected, scale, small;  // small: a change after which the step has settled
    if (fresh) {
      const real far = change < zero + (scalar)5 * step_limit ? zero : one;
      rejected = maximum(far, change < zero + (scalar)2 * tolerance ? zero : indefinite);
      small = shift > zero ? zero + (scalar)10 * tolerance : inexact > zero ? zero + tolerance : zero + close;
      const real less = shift < zero + (scalar)0.05 ? zero : (scalar)0.5 * shift;
      shift = rejected > zero ? maximum((scalar)4 * shift, zero + (scalar)0.25) : less;
      scale = minimum(one, step_limit / maximum(change, zero + (scalar)1e-12));
      full_step = (one - rejected) * (scale < one ? zero : one);
    } else {
      rejected = full_step > zero ? (change < (scalar)0.5 * last_change ? zero : one) : one;
      small = minimum(SQRT(maximum(tolerance * (last_change - change), zero)), zero + (scalar)10 * tolerance);
      scale = one; full_step = full_step * (one - rejected);
    }
    last_change = change;
    scale *= (one - settled) * (one - rejected);
    if (attached) UNROLL for (int c = 0; c < 3; ++c) {
      const real felt = hand_force(c, scale);
      reaction[c] = settled > zero ? reaction[c] : felt;
    }
    WAIT_FOR_TEAM;
    for (int i = member; i < SECTIONS; i += TEAM) UNROLL for (int k = 0; k < DOFS; ++k) {
      const real u = scale * CHANGE(k, i);
      NOW(k, i) -= scale > zero ? u : zero;
    }
    settled = change < small ? maximum(settled, one - rejected) : settled;
    settled = imbalance < balance ? one : settled;
    if (ALL(settled > zero)) break;
  }
  WAIT_FOR_TEAM;
  // a sling that did not converge, or is no number, has failed for good
  outcome = outcome != zero ? outcome : (settled > zero ? zero : zero + (scalar)OUTCOME_NOT_CONVERGED);
  return iteration;
};

// The force of the band on the hand, and whether the pads still hold it
auto feel_band = [&](const real (&reaction)[3]) {
  UNROLL for (int c = 0; c < 3; ++c) {
    force[c] = attached ? -reaction[c] : opening ? capacity * direction[c] : zero;
    held[c] = attached ? force[c] : held[c];
  }
  if (gripped) {
    pull = SQRT(dot(force, force));
    outcome = outcome != zero ? outcome : (pull > capacity ? zero + (scalar)OUTCOME_SLIPPED : zero);  // out of closed fingers
    UNROLL for (int c = 0; c < 3; ++c) direction[c] = force[c] / maximum(pull, zero + (scalar)1e-9);
  }
};

// The projectile separates at the first pull: contact = m (acceleration + gravity) along the launch direction
auto separate = [&](const scalar* row, bool just_free) {
  const scalar h = row[STEP_H], past = row[STEP_PAST];
  real contact = zero, position[3], velocity[3];
  lowest = outcome == zero ? minimum(lowest, LAST(2, MIDDLE)) : lowest;
  UNROLL for (int c = 0; c < 3; ++c) {
    position[c] = NOW(c, MIDDLE);
    velocity[c] = (position[c] - FROM(c, MIDDLE)) * per_step;
    const real v1 = LAST_RATE(c, MIDDLE), v = v1 + past * (v1 - RATE_BEFORE(c, MIDDLE));
    contact += payload * ((velocity[c] - v) * per_step + (c == 2 ? gravity : (scalar)0)) * direction[c];
  }
  const real before = just_free ? contact : contact_before;
  const real w = minimum(maximum(before / maximum(before - contact, zero + (scalar)1e-9), zero), one);
  const real separates = (payload > zero ? one : zero) * (contact > zero ? zero : one);
  UNROLL for (int c = 1; c < 3; ++c) {
    const real x1 = LAST(c, MIDDLE), v1 = LAST_RATE(c, MIDDLE);
    separation[c] = separates > zero ? x1 + w * (position[c] - x1) : separation[c];
    separation[2 + c] = separates > zero ? v1 + w * (velocity[c] - v1) : separation[2 + c];
  }
  separation[0] = separates > zero ? row[STEP_TIME] - ((scalar)1 - w) * h : separation[0];
  payload = separates > zero ? zero : payload;
  const real restless = dot(owed, owed) > (scalar)1e-10 ? zero + (scalar)OUTCOME_NOT_CONVERGED : zero;  // the arm, when it let go
  const real left = restless != zero ? restless : separates * (scalar)OUTCOME_SEPARATED;
  outcome = outcome != zero ? outcome : left;
  contact_before = contact;
};

// Force and iterations; centre lines (with a frame_width of DOFS all degrees of freedom) at the camera's stamps
auto record = [&](int step, int iteration) {
  if (member == 0 && !launching) {
    auto here = OF_SLING(output, OUTPUT_SIZE * steps) + OUTPUT_SIZE * step;
    UNROLL for (int c = 0; c < 3; ++c) here[OUTPUT_FORCE + c] = force[c];
    here[OUTPUT_ITERATIONS] = zero + (scalar)iteration;
  }
  auto seen = OF_SLING(frames, frame_width * SECTIONS * n_frames);
  for (int k = frame_first.data[step]; k < frame_first.data[step + 1]; ++k) {
    const scalar w = frame_weight.data[k];
    for (int i = member; i < SECTIONS; i += TEAM) for (int c = 0; c < frame_width; ++c)
      seen[(k * SECTIONS + i) * frame_width + c] = LAST(c, i) + w * (NOW(c, i) - LAST(c, i));
  }
};

for (int i = member; i < SECTIONS; i += TEAM) UNROLL for (int k = 0; k < DOFS; ++k) {
  const real x = initial[k * SECTIONS + i];
  LAST(k, i) = x; LAST_BUT_ONE(k, i) = x; LAST_RATE(k, i) = zero; RATE_BEFORE(k, i) = zero; NOW(k, i) = x;
}
WAIT_FOR_TEAM;
begin_memory();
WAIT_FOR_TEAM;
for (int step = 0; step < steps; ++step) {
  const scalar* row = schedule.data + (size_t)step * STEP_SIZE;
  const bool relax = row[STEP_MODE] == MODE_RELAX;
  per_step = (scalar)1 / (row[STEP_BETA] * row[STEP_H]); per_step2 = per_step * per_step;
  bend_share = bending * row[STEP_BENDING]; torsion = radius2 / 4 * row[STEP_BENDING];  // guesses relax with less of them first
  damp = damping * per_step; damp_shape = damp * shape_damping; air = relax ? zero : drag * per_step;
  real target[3], reaction[3] = {zero, zero, zero};
  lead_hand(row, target);
  predict(row, target);
  recall(row, relax);
  WAIT_FOR_TEAM;
  update_air(relax);
  WAIT_FOR_TEAM;
  const int iteration = newton(reaction);
  iterations += iteration;
  feel_band(reaction);
  if ((int)row[STEP_GRIP] == GRIP_FREE && launching) separate(row, step <= first_free);
  record(step, iteration);
  WAIT_FOR_TEAM;
  remember(row, relax);
  for (int i = member; i < SECTIONS; i += TEAM) UNROLL for (int k = 0; k < DOFS; ++k) {
    const real now = NOW(k, i), v = relax ? zero : (now - FROM(k, i)) * per_step;
    LAST_BUT_ONE(k, i) = relax ? now : LAST(k, i); LAST(k, i) = now;
    RATE_BEFORE(k, i) = relax ? zero : LAST_RATE(k, i); LAST_RATE(k, i) = v;
  }
  WAIT_FOR_TEAM;
  if (launching && ALL(outcome != zero)) break;
}

for (int i = member; i < SECTIONS; i += TEAM) UNROLL for (int k = 0; k < DOFS; ++k) initial[k * SECTIONS + i] = LAST(k, i);
if (member == 0) {
  lane[LANE_PAYLOAD] = payload; lane[LANE_OUTCOME] = outcome; lane[LANE_LOWEST] = lowest;
  UNROLL for (int c = 0; c < 5; ++c) lane[LANE_SEPARATION + c] = separation[c];
  UNROLL for (int c = 0; c < 3; ++c) lane[LANE_HOLD_FORCE + c] = held[c];
  lane[LANE_ITERATIONS] = zero + (scalar)iterations;
}
