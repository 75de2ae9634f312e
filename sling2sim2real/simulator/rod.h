// The element: an extensible director rod.
//
// Cross-section i holds the node r_i and the directors a_i, b_i of the edge between r_i and r_i+1: 9 degrees of freedom.
// With g_i = (r_i+1 - r_i) / ds, the deformation gradient of an edge is F = [g a b], of the material of
// material.h. Each edge has its own rest length ds, a joint the length l between the middles of its edges, and
//
//   W_joint = mu A / (2 l) [ cb (|a+ - a-|^2 + |b+ - b-|^2) - 2 (cb - ct) tau^2 ]
//   tau = (a+.b- - b+.a-)/2 (twist),  ct = R^2/4 (G I_p),  cb = (1 + nu) R^2/2 (E I)
//
// where -/+ are the edges on both sides of a node, and the twist is taken to first order about the predicted state.
// d s/2 times the first, bending form in the rates damps it: with the twist's part of it, neighbours that are turned
// far from each other would gain energy.
//
// For solve.h and step.h: what one section adds to the Hessian and the residual (stage_section), column by column
// (hessian_column); the masses, and the hand's hold. The first three degrees of freedom are the node's, the others directors.

// a staged section: its own block (lower triangle), stretch between nodes, gradient of the twist on both sides of
// the joint, coefficients of bending and twist, residual of this section and of the next
enum { OWN = 0, STRETCH = 45, TWIST = 51, TWIST_NEXT = 57, BEND = 63, TWISTING = 64, FORCE = 65, FORCE_NEXT = 74, NOTHING = 83, STAGED = 84 };
#if defined(__CUDA_ARCH__)
__shared__ SC staged[STAGED * (L | 1)], hand_terms[54];
#define PUT(v) staged[(v) * (L | 1) + i]
#define GET(v, j) staged[(v) * (L | 1) + (j)]
#else
real staged[STAGED], hand_terms[54];
#define PUT(v) staged[v]
#define GET(v, j) staged[v]
#endif
#define HAND(v) hand_terms[v]
#define RESIDUAL(m, j) GET(FORCE + (m), j)
#define RESIDUAL_NEXT(m, j) GET(FORCE_NEXT + (m), j)
#define LOWER(m, n) ((m) >= (n) ? (m) * ((m) + 1) / 2 + (n) : (n) * ((n) + 1) / 2 + (m))

// which degrees of freedom have an equation: not a node that is clamped or held, nor the directors of the last section, which
// has no edge (they are the clamp's)
auto moves = [&](int i, int m) -> bool {
  if (m >= 3) return i < L - 1;
  return i == 0 ? !first_clamped : i == L - 1 ? !last_clamped : !(i == MID && attached);
};
auto mass_of = [&](int i, int m) -> real {
  const SC before = i ? edge[i - 1] : (SC)0, after = i < L - 1 ? edge[i] : (SC)0;
  const SC length = m < 3 ? (SC)0.5 * (before + after) : (i < L - 1 ? after : before) * radius2 / 4;
  return zero + line_mass * length + (i == MID && m < 3 ? payload : zero);
};
// The air on the moving band, which the projectile does not feel: a linear drag by mass, and that of a cylinder across
// the wind, quadratic: C rho/2 d |v| v for a length, v the part of the speed across the band at the predicted state, d the
// diameter that keeps the volume of what is stretched. Over the step the matrix is c (1 - t t'), kept as c and sqrt(c) t.
#define WIND(k, i) STATE[(9 * N + MEMORIES + (k)) * L + (i)]
auto update_air_drag = [&](bool relax) {
  for (int i = member; i < L; i += T) {
    const int first = i ? i - 1 : 0, last = i < L - 1 ? i + 1 : i;
    real way[3], speed[3];
    UNROLL for (int c = 0; c < 3; ++c) { way[c] = XP(c, last) - XP(c, first); speed[c] = (XP(c, i) - Y(c, i)) * ibh; }
    const SC rest = (i ? edge[i - 1] : (SC)0) + (i < L - 1 ? edge[i] : (SC)0);
    const real length = SQRT(maximum(dot(way, way), zero + (SC)1e-12)), along = dot(way, speed) / length;
    const real whole = dot(speed, speed) - along * along;
    const real stretched = (SC)0.5 * SQRT(length * rest);  // length times how much thinner the band is
    const real c = relax ? zero : wind * stretched * SQRT(maximum(whole, zero)) * ibh, shrunk = SQRT(c) / length;
    WIND(0, i) = c;
    UNROLL for (int k = 0; k < 3; ++k) WIND(1 + k, i) = shrunk * way[k];
  }
};
auto across = [&](int i, int m, int n) -> real { return (m == n ? WIND(0, i) : zero) - WIND(1 + m, i) * WIND(1 + n, i); };
auto wind_of = [&](int i, int m) -> real { return m < 3 ? air * (mass_of(i, m) - (i == MID ? payload : zero)) : zero; };
auto wind_on = [&](int i, int m) -> real {
  real force = wind_of(i, m) * (X(m, i) - Y(m, i));
  if (m < 3) UNROLL for (int n = 0; n < 3; ++n) force += across(i, m, n) * (X(n, i) - Y(n, i));
  return force;
};
// of the hand on the node that it leads, after Newton's change times `scale`, to first order
auto hand_force = [&](int c, real scale) -> real {
  real force = mass_of(MID, c) * ibh2 * (X(c, MID) - XH(c, MID)) + wind_on(MID, c);
  UNROLL for (int side = 0; side < 2; ++side) {
    const int e = MID - 1 + side;
    real after = zero;
    UNROLL for (int n = 0; n < 3; ++n) after += HAND(27 * side + 3 + LOWER(c, n)) * (DX(n, e + 1) - DX(n, e));
    UNROLL for (int n = 0; n < 6; ++n) after -= HAND(27 * side + 9 + 3 * n + c) * DX(3 + n, e);
    after = HAND(27 * side + c) - scale * after;
    force += side ? -after : after;
  }
  return force;
};

auto stage_section = [&](int i) {
  real own[45], f[N], f_next[N];
  UNROLL for (int m = 0; m < 45; ++m) own[m] = zero;
  UNROLL for (int m = 0; m < N; ++m) f_next[m] = zero;
  // ---- inertia and gravity of the node and the directors
  UNROLL for (int m = 0; m < N; ++m) {
    const real mass = mass_of(i, m);
    f[m] = mass * ibh2 * (X(m, i) - XH(m, i)) + wind_on(i, m);
    if (fresh) own[LOWER(m, m)] = mass * ibh2 + wind_of(i, m) + shift * (m < 3 ? zero + node_shift : mu * (area * mean_edge));
  }
  if (fresh) UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n <= m; ++n) own[LOWER(m, n)] += across(i, m, n);
  if (i < L - 1) {
    // ---- edge i: k = 0, 1, 2 are g, a, b; x now, xp predicted, xt rates
    const SC ds = edge[i], per_ds = (SC)1 / ds;
    const real volume = zero + area * ds;
    real x[3][3], xp[3][3], xt[3][3];
    UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int c = 0; c < 3; ++c) {
      const int q = 3 * k + c;
      real now = X(q, i), predicted = XP(q, i), y = Y(q, i);
      if (k == 0) { now = (X(q, i + 1) - now) * per_ds; predicted = (XP(q, i + 1) - predicted) * per_ds; y = (Y(q, i + 1) - y) * per_ds; }
      x[k][c] = now; xp[k][c] = predicted; xt[k][c] = (now - y) * ibh;
    }
    real stress[3][3], K[6][3][3];
#if RUBBER || COROTATED
    material(x, xp, xt, steeper(xp[0]), stress, K);
    add_law(i, x[0], stress[0], K[0]);
#else
    material(x, xp, xt, one, stress, K);
#endif
    UNROLL for (int c = 0; c < 3; ++c) {
      f_next[c] = volume * stress[0][c] * per_ds; f[c] -= f_next[c];
      f[3 + c] += volume * stress[1][c]; f[6 + c] += volume * stress[2][c];
    }
    if (fresh) UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int l = 0; l <= k; ++l)
      UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n < 3; ++n) {
        if (k == l && n > m) continue;
        const real v = volume * K[k * (k + 1) / 2 + l][m][n];
        if (k == 0) { PUT(STRETCH + LOWER(m, n)) = v * (per_ds * per_ds); own[LOWER(m, n)] += v * (per_ds * per_ds); }
        else if (l == 0) own[LOWER(3 * k + m, n)] = -v * per_ds;
        else own[LOWER(3 * k + m, 3 * l + n)] += v;
      }
    if (i == MID - 1 || i == MID) {  // what the hand feels of this edge
      const int side = i - MID + 1;
      UNROLL for (int c = 0; c < 3; ++c) HAND(27 * side + c) = f_next[c];
      if (fresh) UNROLL for (int c = 0; c < 6; ++c) HAND(27 * side + 3 + c) = PUT(STRETCH + c);
      if (fresh) UNROLL for (int m = 0; m < 6; ++m) UNROLL for (int n = 0; n < 3; ++n) HAND(27 * side + 9 + 3 * m + n) = own[LOWER(3 + m, n)];
    }
    // ---- joints: to the next edge; first, where there is one, from a frame that does not move (a clamp, or
    // the fingers, which hold the middle node's direction while they hold it). `from` and `to` are 6 numbers:
    // a, b of the side before and the side after
    const bool from_frame = (i == 0 && first_clamped) || (i == MID && gripped);
    for (int joint = from_frame ? 0 : 1; joint < 2; ++joint) {
      const bool fixed_from = joint == 0, fixed_to = joint == 1 && i == MID - 1 && gripped;
      const SC* frame = clamp.data + (i == 0 ? 0 : 12);
      real from[6], from_p[6], from_t[6], to[6], to_p[6], to_t[6];
      UNROLL for (int c = 0; c < 6; ++c) {
        const int next = fixed_from ? i : i + 1;
        from[c] = X(3 + c, i); from_p[c] = XP(3 + c, i); from_t[c] = (from[c] - Y(3 + c, i)) * ibh;
        to[c] = X(3 + c, next); to_p[c] = XP(3 + c, next); to_t[c] = (to[c] - Y(3 + c, next)) * ibh;
        if (fixed_from) { from[c] = from_p[c] = zero + frame[c]; from_t[c] = zero; }
        if (fixed_to) { to[c] = to_p[c] = zero + frame[c]; to_t[c] = zero; }
      }
      real tw[6], tw_next[6];  // gradient of the twist; tau is bilinear, so that tw.y counts it twice
      UNROLL for (int c = 0; c < 3; ++c) {
        tw[c] = (SC)-0.5 * to_p[3 + c]; tw[3 + c] = (SC)0.5 * to_p[c];
        tw_next[c] = (SC)0.5 * from_p[3 + c]; tw_next[3 + c] = (SC)-0.5 * from_p[c];
      }
      real twist = (SC)-0.5 * (dot(to_p, from_p + 3) - dot(to_p + 3, from_p)), size = zero;
      UNROLL for (int c = 0; c < 6; ++c) {
        twist += tw[c] * from[c] + tw_next[c] * to[c];
        size += tw[c] * tw[c] + tw_next[c] * tw_next[c];
      }
      const SC apart = (SC)0.5 * (fixed_from || fixed_to || i == L - 2 ? ds : ds + edge[i + 1]);  // a frame is half an edge away
      const real weight = zero + (joint == 1 && i == L - 2 && !last_clamped ? (SC)0 : (SC)1);
      const real k = mu * weight * (area / apart), kb = k * cb;
      const real kt = minimum((SC)2 * (kb - k * ct), (SC)1.9 * kb / maximum(size, zero + (SC)1e-3));
      const real hb = kb * (one + dsh), ht = kt;
      if (fixed_from) {
        UNROLL for (int m = 0; m < 6; ++m) {
          f[3 + m] += kb * (to[m] - from[m] + d * s * (to_t[m] - from_t[m])) - kt * twist * tw_next[m];
          if (!fresh) continue;
          own[LOWER(3 + m, 3 + m)] += hb;
          UNROLL for (int n = 0; n <= m; ++n) own[LOWER(3 + m, 3 + n)] -= ht * tw_next[m] * tw_next[n];
        }
      } else {
        const real coupled = zero + (fixed_to ? (SC)0 : (SC)1);
        UNROLL for (int m = 0; m < 6; ++m) {
          const real bend = kb * (from[m] - to[m] + d * s * (from_t[m] - to_t[m]));
          f[3 + m] += bend - kt * twist * tw[m];
          f_next[3 + m] = coupled * (-bend - kt * twist * tw_next[m]);
          if (!fresh) continue;
          own[LOWER(3 + m, 3 + m)] += hb;
          UNROLL for (int n = 0; n <= m; ++n) own[LOWER(3 + m, 3 + n)] -= ht * tw[m] * tw[n];
          PUT(TWIST + m) = tw[m]; PUT(TWIST_NEXT + m) = tw_next[m];
        }
        if (fresh) { PUT(BEND) = coupled * hb; PUT(TWISTING) = coupled * ht; }
      }
    }
  }
  PUT(NOTHING) = zero;
  if (fresh) UNROLL for (int m = 0; m < 45; ++m) PUT(OWN + m) = own[m];
  UNROLL for (int m = 0; m < N; ++m) { PUT(FORCE + m) = f[m]; PUT(FORCE_NEXT + m) = f_next[m]; }
};

// Column c of what staged section i has of the Hessian in solve.h: D of its A, without what the section before adds to
// it; U of its B'; `carry` of what edge and joint between both add to the A of the chain's next section. c = N is the
// residual: of this section in U, of the next one in `carry`.
//
// On a GPU the chain from the last section (`down`) goes on to section i - 1, with which edge and joint are staged: U is
// of the B of that one, and `carry` is for section i itself.
#if defined(__CUDA_ARCH__)
// c is mine, so that where its numbers stand is found once
const bool residual = mine >= N, node = mine < 3, director = !residual && !node;
int own_at[N], coupled_at[N], carried_at[N];
UNROLL for (int m = 0; m < N; ++m) {
  const int block = residual ? NOTHING : OWN + LOWER(m, mine), stretch = node && m < 3 ? STRETCH + LOWER(m, mine) : NOTHING;
  own_at[m] = block;
  // of a node with the next section's node, or of directors with a node: an edge's own directors, whichever section is next
  coupled_at[m] = residual ? FORCE + m : node && m < 3 ? stretch : (down ? director && m < 3 : node && m >= 3) ? block : NOTHING;
  carried_at[m] = residual ? FORCE_NEXT + m : stretch;
}
const int twist_at = director ? (down ? TWIST : TWIST_NEXT) + mine - 3 : NOTHING, carried_twist_at = director ? TWIST_NEXT + mine - 3 : NOTHING;
const int other_twist = down ? TWIST_NEXT : TWIST;
auto hessian_column = [&](int i, int, real* D, real* U, real* carry) {
  const int j = down ? i - 1 : i, k = residual ? i : j;
  const real twisting = -GET(TWISTING, j), coupled = twisting * GET(twist_at, j), carried = twisting * GET(carried_twist_at, j);
  const real bend = director ? GET(BEND, j) : zero, sign = residual ? one : -one;
  UNROLL for (int m = 0; m < N; ++m) { D[m] = GET(own_at[m], i); U[m] = sign * GET(coupled_at[m], k); carry[m] = GET(carried_at[m], j); }
  UNROLL for (int m = 3; m < N; ++m) {
    const real diagonal = m == mine ? bend : zero;
    U[m] += coupled * GET(other_twist + m - 3, j) - diagonal;
    carry[m] += carried * GET(TWIST_NEXT + m - 3, j) + diagonal;
  }
};
#else
auto hessian_column = [&](int i, int c, real* D, real* U, real* carry) {
  const bool residual = c >= N, node = c < 3, director = !residual && !node;
  const real bend = GET(BEND, i), twisting = -GET(TWISTING, i) * GET(TWIST_NEXT + (director ? c - 3 : 0), i);
  UNROLL for (int m = FIRST_ROW(residual ? 0 : c); m < N; ++m) D[m] = GET(OWN + LOWER(m, residual ? 0 : c), i);
  UNROLL for (int m = 0; m < 3; ++m) {
    const int stretch = STRETCH + LOWER(m, node ? c : 0);
    const real here = GET(residual ? FORCE + m : stretch, i), there = GET(residual ? FORCE_NEXT + m : stretch, i);
    U[m] = residual ? here : node ? -here : zero;
    carry[m] = director ? zero : there;
  }
  UNROLL for (int m = 3; m < N; ++m) {
    const real here = GET((residual ? FORCE : TWIST - 3) + m, i), there = GET((residual ? FORCE_NEXT : TWIST_NEXT - 3) + m, i);
    const real diagonal = m == c ? bend : zero;
    U[m] = residual ? here : node ? -D[m] : twisting * here - diagonal;
    carry[m] = residual ? there : node ? zero : twisting * there + diagonal;
  }
};
#endif
