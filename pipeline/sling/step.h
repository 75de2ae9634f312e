// Steps slings through a schedule. A step solves, for all layers at once,
//
//   M (x - xh)/(beta h)^2 + dW/dx + dD/dx' = 0,   x' = (x - y)/(beta h),
//   y = c1 x_n - c2 x_n-1,   xh = y + beta h (c1 v_n - c2 v_n-1) + (beta h)^2 gravity
//
// (backward Euler: beta = c1 = 1, c2 = 0; variable-step BDF2 otherwise) by Newton's method on the
// block-tridiagonal Hessian with a direct LDL' solve; where it is indefinite, its diagonal is shifted.

#if N > 9  // unrolled, it would take minutes to compile
#undef UNROLL
#define UNROLL
#endif

const SC close = sqrt(0.25 * tolerance * shortest_edge);  // from here on Newton's next change is below the tolerance
const SC per_edge = (SC)1 / mean_edge;
for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
  const real x = INITIAL[k * L + i];
  X1(k, i) = x; X2(k, i) = x; V1(k, i) = zero; V2(k, i) = zero; X(k, i) = x;
}
SYNC;
real offset[PLACES], pull = zero, held[3] = {zero, zero, zero};  // of the hand
UNROLL for (int m = 0; m < PLACES; ++m) offset[m] = zero;
auto middle = [&](const real* unknowns, int c) -> real {  // of the held layer: the mean of its places
  real mean = share(0) * unknowns[c * L];
  UNROLL for (int m = 3; m < PLACES; m += 3) mean += share(m) * unknowns[(m + c) * L];
  return mean;
};
real contact_before = zero;  // of the pouch
int iterations = 0;

for (int step = 0; step < steps; ++step) {
  const SC* row = schedule.data + (size_t)step * 13;
  const SC h = row[0], c1 = row[1], c2 = row[2], bh = row[3] * h;  // beta h
  const bool relax = row[4] == 0;
  const int hold = (int)row[5];  // 0 free, 1 held, 2 fingers opening, 3 held in a pouch
  const SC limit = row[9], blend = row[10], time = row[11];
  ibh = (SC)1 / bh; ibh2 = ibh * ibh;
  cb = PAR[5] * row[12]; ct = radius2 / 4 * row[12];  // guesses relax with less of them first
  dh = d * ibh; dsh = dh * s;

  // the hand takes hold of the band where it is, and leads it to its own path
  const bool was_attached = attached;
  attached = hold == 1 || hold == 3; gripped = hold == 1;
  real target[PLACES];
  UNROLL for (int m = 0; m < PLACES; ++m) {
    const SC place = row[6 + m % 3] + in_hand(m);
    if (attached && !was_attached) offset[m] = X1(m, MID) - place;
    target[m] = zero + place + blend * offset[m];
  }
  // what the pads can hold: all of it while they are closed, then less and less of the pull at the release
  const real capacity = hold == 2 ? maximum(pull - limit * friction, zero) : limit * friction;

  // predicted state, and what the step starts from
  for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
    const real x1 = X1(k, i), v1 = V1(k, i), y = c1 * x1 - c2 * X2(k, i);
    const bool led = k < PLACES && i == MID && attached;
    const real x = led ? target[k < PLACES ? k : 0] : x1 + h * v1;
    X(k, i) = x; XP(k, i) = x; Y(k, i) = y;
    XH(k, i) = y + bh * (c1 * v1 - c2 * V2(k, i)) - (k < PLACES && k % 3 == 2 ? gravity * bh * bh : (SC)0);
  }
  SYNC;

  real change = zero, settled = failure != zero ? one : zero, reaction[3] = {zero, zero, zero};
  shift = zero;
  int iteration = 0;
  for (; iteration < max_iterations; ++iteration) {
    // ---- assembly, a layer a member, and elimination, layer after layer
    real D[COLUMNS][N], U[COLUMNS][N], carry[COLUMNS][N], next[COLUMNS][N], before[N];
    real indefinite = zero, imbalance = zero, poison = zero; inexact = zero;  // poison is no number as soon as anything is
    for (int q = 0; q < COLUMNS; ++q) UNROLL for (int m = 0; m < N; ++m) next[q][m] = zero;
    UNROLL for (int m = 0; m < N; ++m) before[m] = zero;
    for (int i = 0; i < L; ++i) {
      const int j = i % T;
      if (j == 0) {
        SYNC;
        if (i + member < L) stage_layer(i + member);
        SYNC;
        // the residual as it is, before elimination mixes it
        if (i + member < L) UNROLL for (int m = 0; m < N; ++m) {
          const real f = RESIDUAL(m, member) + (member ? RESIDUAL_NEXT(m, member - 1) : before[m]);
          if (moves(i + member, m)) {
            imbalance = maximum(imbalance, magnitude(f) * (m < PLACES ? (SC)1 : per_edge)); poison += f * zero;
          }
        }
        UNROLL for (int m = 0; m < N; ++m) before[m] = RESIDUAL_NEXT(m, T - 1);
      }
      const bool special = i == 0 || i == MID - 1 || i == MID || i >= L - 2;
      UNROLL for (int q = 0; q < COLUMNS; ++q) {
        const int c = q + member;
        column(j, c, D[q], U[q], carry[q]);
        // open pads hold the band back with what friction they have left
        if (i == MID && hold == 2 && c >= N) UNROLL for (int m = 0; m < PLACES; ++m) U[q][m] += share(m) * capacity * direction[m % 3];
        if (c >= N) { UNROLL for (int m = 0; m < N; ++m) U[q][m] += next[q][m]; }
        else { UNROLL for (int m = FIRST_ROW(c); m < N; ++m) D[q][m] += next[q][m]; }
        if (special) {
          const bool mine = c >= N || moves(i, c), mine_next = c >= N || (i < L - 1 && moves(i + 1, c));
          UNROLL for (int m = 0; m < N; ++m) {
            if (!moves(i, m) || !mine) D[q][m] = m == c ? one : zero;
            if (!moves(i, m) || !mine_next) U[q][m] = zero;
          }
        }
        UNROLL for (int m = 0; m < N; ++m) next[q][m] = carry[q][m];
      }
      // LDL' of the block, pivot by pivot, with the columns of the coupling
      real whole[COLUMNS], inverse[N], inverse_own[COLUMNS];
      UNROLL for (int q = 0; q < COLUMNS; ++q) {
        whole[q] = COLUMNS > 1 ? magnitude(D[q][q < N ? q : 0]) : zero;
        inverse_own[q] = zero;
        if (COLUMNS == 1) UNROLL for (int m = 0; m < N; ++m) whole[q] = m == member ? magnitude(D[q][m]) : whole[q];
      }
      UNROLL for (int k = 0; k < N; ++k) {
        const real pivot = OF(D, k, k);
        indefinite = pivot > zero ? indefinite : one;
        inverse[k] = one / pivot;
        real multiplier[N];
        UNROLL for (int m = k + 1; m < N; ++m) multiplier[m] = OF(D, k, m) * inverse[k];
        UNROLL for (int q = 0; q < COLUMNS; ++q) {
          const int c = q + member;
          if (COLUMNS == 1 || (c > k && c < N)) {
            const real a = COLUMNS == 1 ? (c > k ? D[q][k] : zero) : D[k][c < N ? c : 0];
            UNROLL for (int m = k + 1; m < N; ++m) if (COLUMNS == 1 || m >= c) D[q][m] -= multiplier[m] * a;
          }
          if (COLUMNS == 1) {
            UNROLL for (int m = k + 1; m < N; ++m) U[q][m] -= multiplier[m] * U[q][k];
            inverse_own[q] = c == k || k == 0 ? inverse[k] : inverse_own[q];
            UNROLL for (int m = k + 1; m < N; ++m) D[q][m] = c == k ? multiplier[m] : D[q][m];
          }
        }
        if (COLUMNS > 1) {
          inverse_own[k < COLUMNS ? k : 0] = inverse[k];
          for (int m = k + 1; m < N; ++m) D[k < COLUMNS ? k : 0][m] = multiplier[m];
        }
      }
      if (COLUMNS > 1) UNROLL for (int q = 0; q < COLUMNS; ++q)
        UNROLL for (int k = 0; k < N; ++k) UNROLL for (int m = k + 1; m < N; ++m) U[q][m] -= D[k < COLUMNS ? k : 0][m] * U[q][k];
      SHARE(U);
      // Schur complement into the next layer; what the back substitution needs is kept
      UNROLL for (int q = 0; q < COLUMNS; ++q) {
        const int c = q + member;
        real scaled[N];
        UNROLL for (int k = 0; k < N; ++k) scaled[k] = U[q][k] * inverse[k];
        UNROLL for (int n = FIRST_ROW(c < N ? c : 0); n < N; ++n) {
          real sum = next[q][n];
          UNROLL for (int k = 0; k < N; ++k) sum -= SHARED(n, k) * scaled[k];
          next[q][n] = sum;
        }
        if (c < N) {
          UNROLL for (int m = 1; m < N; ++m) if (COLUMNS == 1 || m > c) KEEP(i, m, q) = D[q][m];
          UNROLL for (int m = 0; m < N; ++m) KEEP(i, N + m, q) = SHARED(m, c) * inverse_own[q];
          KEEP(i, 2 * N, q) = SHARED(N, c) * inverse_own[q];
        }
      }
    }
    // ---- back substitution
    real x[COLUMNS];
    for (int q = 0; q < COLUMNS; ++q) x[q] = zero;
    change = zero;
    BEGIN_KEPT;
    for (int i = L - 1; i >= 0; --i) {
      NEXT_KEPT(i);
      real z[COLUMNS];
      UNROLL for (int q = 0; q < COLUMNS; ++q) {
        if (COLUMNS > 1 && q == N) continue;
        z[q] = KEPT(i, 2 * N, q);
        if (i < L - 1) UNROLL for (int m = 0; m < N; ++m) z[q] -= KEPT(i, N + m, q) * AT_MEMBER(x, m);
      }
      UNROLL for (int k = N - 1; k > 0; --k) {
        const real known = AT_MEMBER(z, k);
        UNROLL for (int q = 0; q < COLUMNS; ++q) {
          const int c = q + member;
          if (COLUMNS == 1) z[q] -= (c < k ? KEPT(i, k, q) : zero) * known;
          else if (c < k) z[q] -= KEPT(i, k, q) * known;
        }
      }
      UNROLL for (int q = 0; q < COLUMNS; ++q) {
        const int c = q + member;
        x[q] = z[q];
        if (c < N) {
          DX(c, i) = x[q];
          poison += x[q] * zero;
          change = maximum(change, magnitude(x[q]) * (c < PLACES ? (SC)1 : mean_edge));  // a director counts as a turn of its edge
        }
      }
    }
    change = poison == zero ? change : zero + (SC)1e30;
    imbalance = poison == zero ? imbalance : zero + (SC)1e30;
    change = team_maximum(change); imbalance = team_maximum(imbalance); inexact = team_maximum(inexact);
    SYNC;
    // a step that an indefinite Hessian gives, or that goes far, is not made: the Hessian is shifted
    const real refused = maximum(change < zero + (SC)5 * step_limit ? zero : one, change < zero + (SC)2 * tolerance ? zero : indefinite);
    // with the exact Hessian, convergence is quadratic
    const real enough = shift > zero ? zero + (SC)10 * tolerance : inexact > zero ? zero + tolerance : zero + close;
    shift = refused > zero ? maximum((SC)4 * shift, zero + (SC)0.25) : (shift < zero + (SC)0.05 ? zero : (SC)0.5 * shift);
    // lanes that have settled stay as they are, so that a lane never depends on its neighbours
    const real scale = (one - settled) * (one - refused) * minimum(one, step_limit / maximum(change, zero + (SC)1e-12));
    if (attached) UNROLL for (int c = 0; c < 3; ++c) {
      const real force = hand_force(c, scale);
      reaction[c] = settled > zero ? reaction[c] : force;
    }
    SYNC;
    for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
      const real u = scale * DX(k, i);
      X(k, i) -= scale > zero ? u : zero;
    }
    settled = change < enough ? maximum(settled, one - refused) : settled;
    settled = imbalance < balance ? one : settled;
    if (ALL(settled > zero)) break;
  }
  iterations += iteration + 1;
  SYNC;
  // a lane that did not converge, or is no number, has failed for good
  failed_step = failure != zero ? failed_step : zero + (SC)step;
  failure = failure != zero ? failure : (settled > zero ? zero : one);

  // the force of the band on the hand, and whether the pads still hold it
  real force[3];
  UNROLL for (int c = 0; c < 3; ++c) force[c] = attached ? -reaction[c] : hold == 2 ? capacity * direction[c] : zero;
  if (hold == 1) {
    pull = SQRT(dot(force, force));
    failure = failure != zero ? failure : (pull > capacity ? zero + (SC)2 : zero);  // slipped out of closed fingers
    UNROLL for (int c = 0; c < 3; ++c) direction[c] = force[c] / maximum(pull, zero + (SC)1e-9);
  }

  // the projectile leaves at the first pull: contact = m (acceleration + gravity) along the launch direction
  if (hold == 0 && launching) {
    real contact = zero;
    real position[3], velocity[3];
    UNROLL for (int c = 0; c < 3; ++c) {
      const real x = middle(&X(0, MID), c), v = (x - middle(&Y(0, MID), c)) * ibh;
      const real yv = c1 * middle(&V1(0, MID), c) - c2 * middle(&V2(0, MID), c);
      position[c] = x; velocity[c] = v;
      contact += payload * ((v - yv) * ibh + (c == 2 ? gravity : (SC)0)) * direction[c];
    }
    const real before = step > first_free ? contact_before : contact;
    const real w = minimum(maximum(before / maximum(before - contact, zero + (SC)1e-9), zero), one);
    const real leaves = (payload > zero ? one : zero) * (contact > zero ? zero : one);
    UNROLL for (int c = 1; c < 3; ++c) {
      const real before_x = middle(&X1(0, MID), c), before_v = middle(&V1(0, MID), c);
      leaving[c] = leaves > zero ? before_x + w * (position[c] - before_x) : leaving[c];
      leaving[2 + c] = leaves > zero ? before_v + w * (velocity[c] - before_v) : leaving[2 + c];
    }
    leaving[0] = leaves > zero ? time - ((SC)1 - w) * h : leaving[0];
    payload = leaves > zero ? zero : payload;
    failure = failure != zero ? failure : -leaves;  // done: -1 marks a finished launch
    contact_before = contact;
  }
  if (attached) UNROLL for (int c = 0; c < 3; ++c) held[c] = force[c];
  if (member == 0 && !launching) {
    UNROLL for (int c = 0; c < 3; ++c) OUT[4 * step + c] = force[c];
    OUT[4 * step + 3] = zero + (SC)(iteration + 1);
  }
  SYNC;

  // centre lines (with a frame_width of N all unknowns) at the camera's stamps within this step
  for (int k = frame_first.data[step]; k < frame_first.data[step + 1]; ++k) {
    const SC w = frame_weight.data[k];
    for (int i = member; i < L; i += T) for (int c = 0; c < frame_width; ++c)
      FRAME[(k * L + i) * frame_width + c] = X1(c, i) + w * (X(c, i) - X1(c, i));
  }
  for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) {
    const real now = X(k, i), v = relax ? zero : (now - Y(k, i)) * ibh;
    X2(k, i) = relax ? now : X1(k, i); X1(k, i) = now;
    V2(k, i) = relax ? zero : V1(k, i); V1(k, i) = v;
  }
  if (launching && ALL(failure != zero)) break;
}

for (int i = member; i < L; i += T) UNROLL for (int k = 0; k < N; ++k) INITIAL[k * L + i] = X1(k, i);
if (member == 0) {
  LANE[3] = payload; LANE[4] = failure; LANE[5] = failed_step;
  UNROLL for (int c = 0; c < 5; ++c) LANE[6 + c] = leaving[c];
  UNROLL for (int c = 0; c < 3; ++c) LANE[11 + c] = held[c];
  LANE[14] = zero + (SC)iterations;
}
