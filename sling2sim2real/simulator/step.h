// Steps slings through a schedule. A step solves, for all sections at once,
//
//   M (x - xh)/(beta h)^2 + c M x' + dW/dx + dD/dx' = 0,   x' = (x - y)/(beta h),
//   y = x_n + past (x_n - x_n-1),   xh = y + beta h (v_n + past (v_n - v_n-1)) + (beta h)^2 gravity
//
// with the air's drag c on the nodes (not on directors or the projectile), linear and a cylinder's
// (backward Euler: beta = 1, past = 0; variable-step BDF2 otherwise) by Newton's method with the exact Hessian;
// where that is indefinite, its diagonal is shifted.

const SC close = sqrt(0.25 * tolerance * shortest);  // from here on Newton's next change is below the tolerance
// a residual that counts for nothing [N]: by default 3 % of a node's weight, and what a strain of 1e-5 takes
const real balance = tolerance * ((SC)1.5e4 * node_mass * gravity + (SC)5 * mu * area);
real offset[3] = {zero, zero, zero}, pull = zero, held[3] = {zero, zero, zero};  // of the hand; the force on it when it last held
real contact_before = zero, lowest = zero + (SC)1e30;  // of the pouch, and its least height
real given[3] = {zero, zero, zero}, owed[3] = {zero, zero, zero}, relaxed = one;  // an arm that gives way
int iterations = 0;

for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
  const real x = INITIAL[k * L + i];
  X1(k, i) = x; X2(k, i) = x; V1(k, i) = zero; V2(k, i) = zero; X(k, i) = x;
}
SYNC;
#if RUBBER
start_relaxed();
SYNC;
#endif
for (int step = 0; step < steps; ++step) {
  const SC* row = schedule.data + (size_t)step * STEP_SIZE;
  const SC h = row[STEP_H], past = row[STEP_PAST], bh = row[STEP_BETA] * h;
  const bool relax = row[STEP_MODE] == MODE_RELAX;
  const int grip = (int)row[STEP_GRIP];
  const SC grip_force = row[STEP_GRIP_FORCE], blend = row[STEP_BLEND], time = row[STEP_TIME];
  ibh = (SC)1 / bh; ibh2 = ibh * ibh;
  cb = bending * row[STEP_BENDING]; ct = radius2 / 4 * row[STEP_BENDING];  // guesses relax with less of them first
  dh = d * ibh; dsh = dh * s; air = relax ? zero : drag * ibh;

  // ---- the hand takes hold of the band where it is, and leads it to its own path
  const bool was_attached = attached;
  gripped = grip == GRIP_HELD; attached = gripped || grip == GRIP_POUCH; opening = grip == GRIP_OPENING;
  // an arm that gives way rests where its spring holds the force: a fixed point, by Aitken's relaxation
  if (row[STEP_COMPLIANCE] > 0) {
    real turn = zero, size = zero;
    UNROLL for (int c = 0; c < 3; ++c) {
      const real owes = row[STEP_COMPLIANCE] * held[c] - given[c], change = owes - owed[c];
      turn -= owed[c] * change; size += change * change; owed[c] = owes;
    }
    relaxed = minimum(maximum(relaxed * turn / maximum(size, zero + (SC)1e-16), zero + (SC)0.05), one);
    UNROLL for (int c = 0; c < 3; ++c) given[c] += relaxed * owed[c];
  }
  real target[3];
  UNROLL for (int c = 0; c < 3; ++c) {
    const SC place = row[STEP_TARGET + c];
    if (attached && !was_attached) offset[c] = X1(c, MID) - place;
    target[c] = given[c] + place + blend * offset[c];
  }
  // what the pads can hold: all of it while they are closed, then less and less of the pull at the release
  capacity = opening ? maximum(pull - grip_force * friction, zero) : grip_force * friction;

  // ---- predicted state, and what the step starts from
  for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
    const real x1 = X1(k, i), v1 = V1(k, i), y = x1 + past * (x1 - X2(k, i));
    const bool led = k < 3 && i == MID && attached;
    const real x = led ? target[k < 3 ? k : 0] : moves(i, k) ? x1 + h * v1 : x1;
    X(k, i) = x; XP(k, i) = x; Y(k, i) = y;
    XH(k, i) = y + bh * (v1 + past * (v1 - V2(k, i))) - (k == 2 ? gravity * bh * bh : (SC)0);
  }
#if RUBBER
  recall(row, relax);
#endif
  SYNC;
  update_air_drag(relax);
  SYNC;

  // ---- Regularised Newton's method with a Hessian that may be frozen: (H + shift I) change = residual
  //
  //   fresh    H is of this iterate. Where it is indefinite, or its step goes far, the step is rejected and the
  //            diagonal is shifted more (Levenberg), else less. Convergence is quadratic: a change c leaves one of some c^2.
  //   frozen   H is that of the iterate before (the chord method; Kelley, Solving Nonlinear Equations with Newton's Method,
  //            2003). Convergence is linear: two changes c0, c1 leave c1^2 / (c0 - c1). A step that does not halve the
  //            last change, or follows one that was cut, is rejected.
  //
  // Lanes that have settled stay as they are, so that a lane never depends on its neighbours.
  real settled = outcome != zero ? one : zero, reaction[3] = {zero, zero, zero};
  real last_change = zero, full_step = zero;  // of the step before: its size, and whether it was made whole
  shift = zero;
  int iteration = 0;
  while (iteration < max_iterations) {
#if AGAIN
    fresh = iteration % 2 == 0 || iteration > 6;  // a frozen one costs half; a hard step has all fresh
#endif
    ++iteration;
    solve();
    real rejected, scale, small;  // small: a change after which the step has settled
    if (fresh) {
      const real far = change < zero + (SC)5 * step_limit ? zero : one;
      rejected = maximum(far, change < zero + (SC)2 * tolerance ? zero : indefinite);
      small = shift > zero ? zero + (SC)10 * tolerance : inexact > zero ? zero + tolerance : zero + close;
      shift = rejected > zero ? maximum((SC)4 * shift, zero + (SC)0.25) : (shift < zero + (SC)0.05 ? zero : (SC)0.5 * shift);
      scale = minimum(one, step_limit / maximum(change, zero + (SC)1e-12));
      full_step = (one - rejected) * (scale < one ? zero : one);
    } else {
      rejected = full_step > zero ? (change < (SC)0.5 * last_change ? zero : one) : one;
      small = minimum(SQRT(maximum(tolerance * (last_change - change), zero)), zero + (SC)10 * tolerance);
      scale = one; full_step = full_step * (one - rejected);
    }
    last_change = change;
    scale *= (one - settled) * (one - rejected);
    if (attached) UNROLL for (int c = 0; c < 3; ++c) {
      const real force = hand_force(c, scale);
      reaction[c] = settled > zero ? reaction[c] : force;
    }
    SYNC;
    for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
      const real u = scale * DX(k, i);
      X(k, i) -= scale > zero ? u : zero;
    }
    settled = change < small ? maximum(settled, one - rejected) : settled;
    settled = imbalance < balance ? one : settled;
    if (ALL(settled > zero)) break;
  }
  iterations += iteration;
  SYNC;
  // a lane that did not converge, or is no number, has failed for good
  outcome = outcome != zero ? outcome : (settled > zero ? zero : zero + (SC)OUTCOME_NOT_CONVERGED);

  // ---- the force of the band on the hand, and whether the pads still hold it
  real force[3];
  UNROLL for (int c = 0; c < 3; ++c) {
    force[c] = attached ? -reaction[c] : opening ? capacity * direction[c] : zero;
    held[c] = attached ? force[c] : held[c];
  }
  if (gripped) {
    pull = SQRT(dot(force, force));
    outcome = outcome != zero ? outcome : (pull > capacity ? zero + (SC)OUTCOME_SLIPPED : zero);  // slipped out of closed fingers
    UNROLL for (int c = 0; c < 3; ++c) direction[c] = force[c] / maximum(pull, zero + (SC)1e-9);
  }

  // ---- the projectile separates at the first pull: contact = m (acceleration + gravity) along the launch direction
  if (grip == GRIP_FREE && launching) {
    real contact = zero, position[3], velocity[3];
    lowest = outcome == zero ? minimum(lowest, X1(2, MID)) : lowest;
    UNROLL for (int c = 0; c < 3; ++c) {
      position[c] = X(c, MID);
      velocity[c] = (position[c] - Y(c, MID)) * ibh;
      const real v1 = V1(c, MID), v = v1 + past * (v1 - V2(c, MID));
      contact += payload * ((velocity[c] - v) * ibh + (c == 2 ? gravity : (SC)0)) * direction[c];
    }
    const real before = step > first_free ? contact_before : contact;
    const real w = minimum(maximum(before / maximum(before - contact, zero + (SC)1e-9), zero), one);
    const real separates = (payload > zero ? one : zero) * (contact > zero ? zero : one);
    UNROLL for (int c = 1; c < 3; ++c) {
      const real x1 = X1(c, MID), v1 = V1(c, MID);
      separation[c] = separates > zero ? x1 + w * (position[c] - x1) : separation[c];
      separation[2 + c] = separates > zero ? v1 + w * (velocity[c] - v1) : separation[2 + c];
    }
    separation[0] = separates > zero ? time - ((SC)1 - w) * h : separation[0];
    payload = separates > zero ? zero : payload;
    const real restless = dot(owed, owed) > (SC)1e-10 ? zero + (SC)OUTCOME_NOT_CONVERGED : zero;  // the arm, when it let go
    outcome = outcome != zero ? outcome : restless != zero ? restless : separates * (SC)OUTCOME_SEPARATED;  // done: a finished launch
    contact_before = contact;
  }

  // ---- records: force and iterations; centre lines (with a frame_width of N all degrees of freedom) at the camera's stamps
  if (member == 0 && !launching) {
    UNROLL for (int c = 0; c < 3; ++c) OUT[OUTPUT_SIZE * step + OUTPUT_FORCE + c] = force[c];
    OUT[OUTPUT_SIZE * step + OUTPUT_ITERATIONS] = zero + (SC)iteration;
  }
  SYNC;
  for (int k = frame_first.data[step]; k < frame_first.data[step + 1]; ++k) {
    const SC w = frame_weight.data[k];
    for (int i = member; i < L; i += T) for (int c = 0; c < frame_width; ++c)
      FRAME[(k * L + i) * frame_width + c] = X1(c, i) + w * (X(c, i) - X1(c, i));
  }
#if RUBBER
  remember(row, relax);
#endif
  for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
    const real now = X(k, i), v = relax ? zero : (now - Y(k, i)) * ibh;
    X2(k, i) = relax ? now : X1(k, i); X1(k, i) = now;
    V2(k, i) = relax ? zero : V1(k, i); V1(k, i) = v;
  }
  SYNC;
  if (launching && ALL(outcome != zero)) break;
}

for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) INITIAL[k * L + i] = X1(k, i);
if (member == 0) {
  LANE[LANE_PAYLOAD] = payload; LANE[LANE_OUTCOME] = outcome; LANE[LANE_LOWEST] = lowest;
  UNROLL for (int c = 0; c < 5; ++c) LANE[LANE_SEPARATION + c] = separation[c];
  UNROLL for (int c = 0; c < 3; ++c) LANE[LANE_HOLD_FORCE + c] = held[c];
  LANE[LANE_ITERATIONS] = zero + (SC)iterations;
}
