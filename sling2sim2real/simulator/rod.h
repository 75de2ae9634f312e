// The element: an extensible director rod.
//
// Unknowns: section i holds the node r_i and the directors a_i, b_i of the edge between r_i and r_i+1, 9 degrees of freedom.
// With g_i = (r_i+1 - r_i) / ds, the deformation gradient of an edge is F = [g a b], of the material of material.h. Each
// edge has its own rest length ds, a joint the length l between the middles of its edges, and
//
//   W_joint = mu A / (2 l) [ cb (|a+ - a-|^2 + |b+ - b-|^2) - 2 (cb - ct) tau^2 ]
//   tau = (a+.b- - b+.a-)/2 (twist),  ct = R^2/4 (G I_p),  cb = (1 + nu) R^2/2 (E I)
//
// where -/+ are the edges on both sides of a node, and the twist is taken to first order about the predicted state.
// d s/2 times the first, bending form in the rates damps it: with the twist's part of it, neighbours that are turned
// far from each other would gain energy.
//
// For solve.h and step.h: the residual and what a section has of the Hessian (stage_section), column by column
// (own_column, coupling_column, carried_column); the masses, the air, and the hand's hold.

#define LOWER(m, n) ((m) >= (n) ? (m) * ((m) + 1) / 2 + (n) : (n) * ((n) + 1) / 2 + (m))

// which degrees of freedom have an equation: not a node that is clamped or held, nor the directors of the last section, which
// has no edge (they are the clamp's)
auto moves = [&](int i, int m) -> bool {
  if (m >= 3) return i < SECTIONS - 1;
  return i == 0 ? !first_clamped : i == SECTIONS - 1 ? !last_clamped : !(i == MIDDLE && attached);
};
auto mass_of = [&](int i, int m) -> real {
  const scalar before = i ? edge[i - 1] : (scalar)0, after = i < SECTIONS - 1 ? edge[i] : (scalar)0;
  const scalar length = m < 3 ? (scalar)0.5 * (before + after) : (i < SECTIONS - 1 ? after : before) * radius2 / 4;
  return zero + line_mass * length + (i == MIDDLE && m < 3 ? payload : zero);
};

// The air on the moving band, which the projectile does not feel: a linear drag by mass, and that of a cylinder across
// the wind, quadratic: C rho/2 d |v| v for a length, v the part of the speed across the band at the predicted state, d the
// diameter that keeps the volume of what is stretched. Over the step the matrix is c (1 - t t'), stored as c and sqrt(c) t.
#define AIR(k, i) stored[(9 * DOFS + MEMORIES + (k)) * SECTIONS + (i)]
auto update_air = [&](bool relax) {
  for (int i = member; i < SECTIONS; i += TEAM) {
    const int first = i ? i - 1 : 0, last = i < SECTIONS - 1 ? i + 1 : i;
    real way[3], speed[3];
    UNROLL for (int c = 0; c < 3; ++c) {
      way[c] = PREDICTED(c, last) - PREDICTED(c, first);
      speed[c] = (PREDICTED(c, i) - FROM(c, i)) * per_step;
    }
    const scalar rest = (i ? edge[i - 1] : (scalar)0) + (i < SECTIONS - 1 ? edge[i] : (scalar)0);
    const real length = SQRT(maximum(dot(way, way), zero + (scalar)1e-12)), along = dot(way, speed) / length;
    const real across = dot(speed, speed) - along * along;
    const real stretched = (scalar)0.5 * SQRT(length * rest);  // length times how much thinner the band is
    const real c = relax ? zero : wind * stretched * SQRT(maximum(across, zero)) * per_step, shrunk = SQRT(c) / length;
    AIR(0, i) = c;
    UNROLL for (int k = 0; k < 3; ++k) AIR(1 + k, i) = shrunk * way[k];
  }
};
auto wind_matrix = [&](int i, int m, int n) -> real { return (m == n ? AIR(0, i) : zero) - AIR(1 + m, i) * AIR(1 + n, i); };
auto linear_drag = [&](int i, int m) -> real { return m < 3 ? air * (mass_of(i, m) - (i == MIDDLE ? payload : zero)) : zero; };
auto air_force = [&](int i, int m) -> real {
  real force = linear_drag(i, m) * (NOW(m, i) - FROM(m, i));
  if (m < 3) UNROLL for (int n = 0; n < 3; ++n) force += wind_matrix(i, m, n) * (NOW(n, i) - FROM(n, i));
  return force;
};

// Inertia and gravity of a section, and the air on it: residual `f` and lower triangle `own`
auto add_inertia = [&](int i, real (&own)[45], real (&f)[DOFS]) {
  UNROLL for (int m = 0; m < DOFS; ++m) {
    const real mass = mass_of(i, m);
    f[m] = mass * per_step2 * (NOW(m, i) - INERTIAL(m, i)) + air_force(i, m);
    const real shifted = shift * (m < 3 ? zero + node_shift : mu * (area * mean_edge));
    if (fresh) own[LOWER(m, m)] = mass * per_step2 + linear_drag(i, m) + shifted;
  }
  if (fresh) UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n <= m; ++n) own[LOWER(m, n)] += wind_matrix(i, m, n);
};

// The material of edge i, k = 0, 1, 2 being g, a, b: x now, xp predicted, xt rates
auto add_edge = [&](int i, real (&own)[45], real (&f)[DOFS], real (&f_next)[DOFS]) {
  const scalar per_ds = (scalar)1 / edge[i];
  const real volume = zero + area * edge[i];
  real x[3][3], xp[3][3], xt[3][3], stress[3][3], K[6][3][3];
  UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int c = 0; c < 3; ++c) {
    const int q = 3 * k + c;
    real now = NOW(q, i), predicted = PREDICTED(q, i), from = FROM(q, i);
    if (k == 0) {
      now = (NOW(q, i + 1) - now) * per_ds;
      predicted = (PREDICTED(q, i + 1) - predicted) * per_ds;
      from = (FROM(q, i + 1) - from) * per_ds;
    }
    x[k][c] = now; xp[k][c] = predicted; xt[k][c] = (now - from) * per_step;
  }
  material(x, xp, xt, steeper(xp[0]), stress, K);
  add_law(i, x[0], stress[0], K[0]);
  UNROLL for (int c = 0; c < 3; ++c) {
    f_next[c] = volume * stress[0][c] * per_ds; f[c] -= f_next[c];
    f[3 + c] += volume * stress[1][c]; f[6 + c] += volume * stress[2][c];
  }
  if (fresh) UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int l = 0; l <= k; ++l)
    UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n < 3; ++n) {
      if (k == l && n > m) continue;
      const real v = volume * K[k * (k + 1) / 2 + l][m][n];
      if (k == 0) { STAGED(STRETCH + LOWER(m, n), i) = v * (per_ds * per_ds); own[LOWER(m, n)] += v * (per_ds * per_ds); }
      else if (l == 0) own[LOWER(3 * k + m, n)] = -v * per_ds;
      else own[LOWER(3 * k + m, 3 * l + n)] += v;
    }
};

// The joint from edge i to the next; or to edge i from a frame that does not move: a clamp, or the fingers, which hold the
// middle node's direction while they hold it. `from` and `to` are 6 numbers, a and b of the side before and after
auto add_joint = [&](int i, bool from_frame, real (&own)[45], real (&f)[DOFS], real (&f_next)[DOFS]) {
  const bool to_frame = !from_frame && i == MIDDLE - 1 && gripped;
  const scalar* frame = clamp.data + (i == 0 ? 0 : 12);
  real from[6], from_p[6], from_t[6], to[6], to_p[6], to_t[6];
  UNROLL for (int c = 0; c < 6; ++c) {
    const int next = from_frame ? i : i + 1;
    from[c] = NOW(3 + c, i); from_p[c] = PREDICTED(3 + c, i); from_t[c] = (from[c] - FROM(3 + c, i)) * per_step;
    to[c] = NOW(3 + c, next); to_p[c] = PREDICTED(3 + c, next); to_t[c] = (to[c] - FROM(3 + c, next)) * per_step;
    if (from_frame) { from[c] = from_p[c] = zero + frame[c]; from_t[c] = zero; }
    if (to_frame) { to[c] = to_p[c] = zero + frame[c]; to_t[c] = zero; }
  }
  real tw[6], tw_next[6];  // gradient of the twist; tau is bilinear, so that tw.y counts it twice
  UNROLL for (int c = 0; c < 3; ++c) {
    tw[c] = (scalar)-0.5 * to_p[3 + c]; tw[3 + c] = (scalar)0.5 * to_p[c];
    tw_next[c] = (scalar)0.5 * from_p[3 + c]; tw_next[3 + c] = (scalar)-0.5 * from_p[c];
  }
  real gradient[6];  // by this section's directors
  UNROLL for (int c = 0; c < 6; ++c) gradient[c] = from_frame ? tw_next[c] : tw[c];
  real twist = (scalar)-0.5 * (dot(to_p, from_p + 3) - dot(to_p + 3, from_p)), size = zero;
  UNROLL for (int c = 0; c < 6; ++c) {
    twist += tw[c] * from[c] + tw_next[c] * to[c];
    size += tw[c] * tw[c] + tw_next[c] * tw_next[c];
  }
  // a frame is half an edge away
  const scalar apart = (scalar)0.5 * (from_frame || to_frame || i == SECTIONS - 2 ? edge[i] : edge[i] + edge[i + 1]);
  const real weight = zero + (!from_frame && i == SECTIONS - 2 && !last_clamped ? (scalar)0 : (scalar)1);
  const real k = mu * weight * (area / apart), kb = k * bend_share;
  const real kt = minimum((scalar)2 * (kb - k * torsion), (scalar)1.9 * kb / maximum(size, zero + (scalar)1e-3));
  const real hb = kb * (one + damp_shape), coupled = zero + (to_frame ? (scalar)0 : (scalar)1);
  if (fresh && !from_frame) { STAGED(BEND, i) = coupled * hb; STAGED(TWISTING, i) = coupled * kt; }
  UNROLL for (int m = 0; m < 6; ++m) {
    const real bend = kb * (from[m] - to[m] + damping * shape_damping * (from_t[m] - to_t[m]));
    f[3 + m] += (from_frame ? -bend : bend) - kt * twist * gradient[m];
    if (!from_frame) f_next[3 + m] = coupled * (-bend - kt * twist * tw_next[m]);
    if (!fresh) continue;
    own[LOWER(3 + m, 3 + m)] += hb;
    UNROLL for (int n = 0; n <= m; ++n) own[LOWER(3 + m, 3 + n)] -= kt * gradient[m] * gradient[n];
    if (!from_frame) { STAGED(TWIST + m, i) = tw[m]; STAGED(TWIST_NEXT + m, i) = tw_next[m]; }
  }
};

auto stage_section = [&](int i) {
  real own[45], f[DOFS], f_next[DOFS];
  UNROLL for (int m = 0; m < 45; ++m) own[m] = zero;
  UNROLL for (int m = 0; m < DOFS; ++m) f_next[m] = zero;
  add_inertia(i, own, f);
  if (i < SECTIONS - 1) {
    add_edge(i, own, f, f_next);
    const bool from_frame = (i == 0 && first_clamped) || (i == MIDDLE && gripped);
    for (int joint = from_frame ? 0 : 1; joint < 2; ++joint) add_joint(i, joint == 0, own, f, f_next);
  }
  STAGED(NOTHING, i) = zero;
  if (fresh) UNROLL for (int m = 0; m < 45; ++m) STAGED(OWN + m, i) = own[m];
  UNROLL for (int m = 0; m < DOFS; ++m) { STAGED_FORCE(m, i) = f[m]; STAGED_FORCE_NEXT(m, i) = f_next[m]; }
};

// Columns of the Hessian in solve.h, of staged sections; column DOFS is the residual. That of a section's own block, without
// what the edge before it adds:
auto own_column = [&](int i, int c, real* column) {
  const bool residual = c >= DOFS;
  UNROLL for (int m = LOWER_PART_FROM(residual ? 0 : c); m < DOFS; ++m)
    column[m] = STAGED(residual ? NOTHING : OWN + LOWER(m, c), i);
};
// of the block with rows of section i and columns of the chain's next one. A node is coupled with the other node, by the
// stretch, and with the directors of the edge between; these by bending and twist with the other directors
auto coupling_column = [&](int i, int c, const real* own, real* column) {
  const bool residual = c >= DOFS, node = c < 3, director = !residual && !node;
  const int between = backwards ? i - 1 : i, at = residual ? i : between;
  const real bend = STAGED(BEND, between);
  const real twisting = -STAGED(TWISTING, between) * STAGED((backwards ? TWIST : TWIST_NEXT) + (director ? c - 3 : 0), between);
  UNROLL for (int m = 0; m < 3; ++m) {
    const real there = STAGED(residual ? FORCE + m : node ? STRETCH + LOWER(m, c) : backwards ? OWN + LOWER(c, m) : NOTHING, at);
    column[m] = residual ? there : director && !backwards ? zero : -there;
  }
  UNROLL for (int m = 3; m < DOFS; ++m) {
    const real there = STAGED(residual ? FORCE + m : (backwards ? TWIST_NEXT : TWIST) + m - 3, at);
    column[m] = residual ? there : node ? (backwards ? zero : -own[m]) : twisting * there - (m == c ? bend : zero);
  }
};
// of what edge e and its joint add to the block of section e + 1
auto carried_column = [&](int e, int c, real* column) {
  const bool residual = c >= DOFS, node = c < 3, director = !residual && !node;
  const real bend = STAGED(BEND, e), twisting = -STAGED(TWISTING, e) * STAGED(TWIST_NEXT + (director ? c - 3 : 0), e);
  UNROLL for (int m = 0; m < 3; ++m) {
    const real there = STAGED(residual ? FORCE_NEXT + m : node ? STRETCH + LOWER(m, c) : NOTHING, e);
    column[m] = director ? zero : there;
  }
  UNROLL for (int m = 3; m < DOFS; ++m) {
    const real there = STAGED((residual ? FORCE_NEXT : TWIST_NEXT - 3) + m, e);
    column[m] = residual ? there : node ? zero : twisting * there + (m == c ? bend : zero);
  }
};

// of the hand on the node that it leads, after Newton's change times `scale`, to first order
auto hand_force = [&](int c, real scale) -> real {
  real force = mass_of(MIDDLE, c) * per_step2 * (NOW(c, MIDDLE) - INERTIAL(c, MIDDLE)) + air_force(MIDDLE, c);
  UNROLL for (int side = 0; side < 2; ++side) {
    const int e = MIDDLE - 1 + side;
    real after = zero;
    UNROLL for (int n = 0; n < 3; ++n) after += STAGED(STRETCH + LOWER(c, n), e) * (CHANGE(n, e + 1) - CHANGE(n, e));
    UNROLL for (int n = 0; n < 6; ++n) after -= STAGED(OWN + LOWER(3 + n, c), e) * CHANGE(3 + n, e);
    after = STAGED_FORCE_NEXT(c, e) - scale * after;
    force += side ? -after : after;
  }
  return force;
};
