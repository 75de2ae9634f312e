// The sling as an extensible director rod, stepped implicitly; one text for 16 CPU lanes and one CUDA thread.
//
// A layer i holds the node r_i and the directors a_i, b_i of the edge between r_i and r_i+1: 9 unknowns.
// With g_i = (r_i+1 - r_i) / ds, the deformation gradient of an edge is F = [g a b], J = det F. Each edge
// has its own rest length ds, a joint the length l between the middles of its edges, and
//
//   W_edge  = A ds [ mu/2 (|F|^2 - 3) - mu (J - 1) + lam/2 (J - 1)^2 ]        (stable neo-Hookean)
//   W_joint = mu A / (2 l) [ cb (|a+ - a-|^2 + |b+ - b-|^2) - 2 (cb - ct) tau^2 ]
//   tau = (a+.b- - b+.a-)/2 (twist),  ct = R^2/4 (G I_p),  cb = (1 + nu) R^2/2 (E I)
//
// where -/+ are the edges on both sides of a node. Viscous stress is d times the rate of the elastic
// (nominal) stress: the tangent of W at the predicted state, applied to the rates. Its shape part is
// scaled by s, the volume part K J'^2 (K = lam - mu/3) is not, and the coefficient p = lam (J - 1) - mu
// is bounded by mu / max(|g|, |a|, |b|), so that a slack band dissipates too:
//
//   D_edge = A ds d/2 [ K J'^2 + s ( mu |F'|^2 + p d2J(F', F') + mu/3 J'^2 ) ],  D_joint: d s/2 times
//   the quadratic form of W_joint in the rates.
//
// A step solves, for all layers at once,
//
//   M (x - xh)/(beta h)^2 + dW/dx + dD/dx' = 0,   x' = (x - y)/(beta h),
//   y = c1 x_n - c2 x_n-1,   xh = y + beta h (c1 v_n - c2 v_n-1) + (beta h)^2 gravity
//
// (backward Euler: beta = c1 = 1, c2 = 0; variable-step BDF2 otherwise) by Newton's method on the
// block-tridiagonal Hessian with a direct LDL' solve; where it is indefinite, its diagonal is shifted.
//
// Wants the macros SC (float or double), W (lanes), L (layers = edges + 1), MID (the held layer).

#define N 9
#define LAYER_WORK (N * N + N * (N + 1) / 2 + N)

#if defined(__CUDA_ARCH__)
typedef SC real;
const int block = tid / W, lane = tid % W;
#define ROW(array, size) (array.data + (size_t)block * (size) * W + lane)
#define AT(p, i) (p)[(size_t)(i) * W]
#define SQRT(x) sqrt(x)
#define ALL(mask) (mask)
#else
typedef SC real __attribute__((vector_size(sizeof(SC) * W), aligned(sizeof(SC))));
const int block = tid;
#define ROW(array, size) ((real*)array.data + (size_t)block * (size))
#define AT(p, i) (p)[i]
auto root = [](real x) -> real { real y; for (int k = 0; k < W; ++k) y[k] = __builtin_sqrt(x[k]); return y; };
auto every = [](auto mask) -> bool { bool all = true; for (int k = 0; k < W; ++k) all &= (mask[k] != 0); return all; };
#define SQRT(x) root(x)
#define ALL(mask) every(mask)
#endif
const real zero = real() * (SC)0, one = zero + (SC)1;
auto maximum = [](real x, real y) -> real { return x > y ? x : y; };
auto minimum = [](real x, real y) -> real { return x < y ? x : y; };
auto magnitude = [&](real x) -> real { return x < zero ? -x : x; };
auto dot = [](const real* x, const real* y) -> real { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
auto cross = [](const real* x, const real* y, real* z) {
  z[0] = x[1] * y[2] - x[2] * y[1]; z[1] = x[2] * y[0] - x[0] * y[2]; z[2] = x[0] * y[1] - x[1] * y[0]; };

const SC mean_edge = geometry.data[0], area = geometry.data[1], radius2 = geometry.data[2];
const SC line_mass = geometry.data[3], gravity = geometry.data[4], node_mass = line_mass * mean_edge;
const SC* edge = lengths.data;  // rest length of each edge
const SC tolerance = geometry.data[5], step_limit = geometry.data[6];
const int max_iterations = (int)geometry.data[7];
const bool first_clamped = geometry.data[8] > 0, last_clamped = geometry.data[9] > 0;

auto X = ROW(state, 6 * L * N), X1 = X + (&AT(X, L * N) - &AT(X, 0)), X2 = X1 + (X1 - X), V1 = X2 + (X1 - X),
     V2 = V1 + (X1 - X), XP = V2 + (X1 - X);
auto WORK = ROW(work, L * LAYER_WORK);
auto PAR = ROW(parameter, 6);
auto OUT = ROW(output, 4 * steps);
auto LANE = ROW(lane_state, 16);
auto FRAME = ROW(frames, frame_width * L * n_frames);

const real mu = AT(PAR, 0), lam = AT(PAR, 1), bulk = lam - mu / (SC)3, d = AT(PAR, 2), s = AT(PAR, 3), friction = AT(PAR, 4);
const real balance = (SC)3e-2 * node_mass * gravity + (SC)1e-5 * mu * area;  // N
const SC node_shift = node_mass * (SC)2.5e5;  // the inertia of a 2 ms step

// lane state: 0 attached, 1-3 direction of the pull (of the launch), 4 failure, 5 failed step, 6-8 grasp
// offset, 9 projectile mass carried, 10 leaving time, 11-12 leaving position and 13-14 velocity (y, z),
// 15 pull at the release
real attached = AT(LANE, 0), failure = AT(LANE, 4), payload = AT(LANE, 9);

for (int step = first_step; step < last_step; ++step) {
  const SC* T = schedule.data + (size_t)step * 13;
  const SC h = T[0], c1 = T[1], c2 = T[2], bh = T[3] * h;  // beta h
  const int mode = (int)T[4], hold = (int)T[5];            // mode 0: relax; hold 0: free, 1: held,
                                                           // 2: fingers opening, 3: held in a pouch
  const SC limit = T[9], blend = T[10], time = T[11];
  const real cb = AT(PAR, 5) * T[12];  // (1 + nu) R^2 / 2, or as measured; guesses relax with less first
  const SC ct = radius2 / 4 * T[12];
  const SC ibh = (SC)1 / bh, ibh2 = ibh * ibh;

  // the hand takes hold of the band where it is, and leads it to its own path
  if (hold == 1 || hold == 3) for (int c = 0; c < 3; ++c) {
    const real first = one - attached;
    AT(LANE, 6 + c) = first * (AT(X1, MID * N + c) - T[6 + c]) + attached * AT(LANE, 6 + c);
  }
  if (hold == 1 || hold == 3) attached = one;
  if (hold == 0 || hold == 2) attached = zero;
  // what the pads can hold: all of it while they are closed, then less and less of the pull at the release
  const real capacity = hold == 2 ? maximum(AT(LANE, 15) - limit * friction, zero) : limit * friction;

  // predicted state
  for (int j = 0; j < L * N; ++j) {
    const real x1 = AT(X1, j), x = x1 + h * AT(V1, j);
    AT(XP, j) = x;
    AT(X, j) = x;
  }
  for (int c = 0; c < 3; ++c) {
    const real target = zero + T[6 + c] + blend * AT(LANE, 6 + c);
    const int j = MID * N + c;
    const real x = attached > zero ? target : AT(X, j);
    AT(X, j) = x; AT(XP, j) = x;
  }
  const real freed = one - attached, gripped = hold == 3 ? zero : attached;

  real residual_mid[3], reaction[3], before_mid[3][N], at_mid[6][3], after_mid[3][3], change = zero, settled = failure != zero ? one : zero, shift = zero;
  for (int c = 0; c < 3; ++c) reaction[c] = zero;
  int iteration = 0;
  for (; iteration < max_iterations; ++iteration) {
    real D[N][N], O[N][N], D1[N][N], r[N], r1[N], eliminated[N], indefinite = zero, imbalance = zero, poison = zero;  // poison is no number as soon as anything is
    for (int m = 0; m < N; ++m) { r1[m] = eliminated[m] = zero; for (int n = 0; n < N; ++n) D1[m][n] = zero; }
    for (int i = 0; i < L; ++i) {
      for (int m = 0; m < N; ++m) {
        r[m] = r1[m]; r1[m] = zero;
        for (int n = 0; n < N; ++n) { D[m][n] = D1[m][n]; D1[m][n] = zero; O[m][n] = zero; }
      }
      // inertia and gravity
      for (int m = 0; m < N; ++m) {
        const int j = i * N + m;
        const real y = c1 * AT(X1, j) - c2 * AT(X2, j), yv = c1 * AT(V1, j) - c2 * AT(V2, j);
        real mass = zero + line_mass * (m < 3 ? (SC)0.5 * ((i ? edge[i - 1] : (SC)0) + (i < L - 1 ? edge[i] : (SC)0))
                                              : (i < L - 1 ? edge[i] : edge[i - 1]) * radius2 / 4);
        if (i == MID && m < 3) mass = mass + payload;
        real xh = y + bh * yv;
        if (m == 2) xh = xh - gravity * bh * bh;
        const real f = mass * ibh2 * (AT(X, j) - xh);
        r[m] += f; D[m][m] += mass * ibh2 + shift * (m < 3 ? zero + node_shift : mu * (area * mean_edge));
        if (i == MID && m < 3) residual_mid[m] += f;
      }
      if (i < L - 1) {
        // ---- edge i: k = 0, 1, 2 are g, a, b; x now, xp predicted, xt rates
        const SC ds = edge[i];
        const real volume = zero + area * ds;
        real x[3][3], xp[3][3], xt[3][3];
        for (int c = 0; c < 3; ++c) {
          const int j = i * N + c;
          for (int k = 0; k < 3; ++k) {
            const int q = j + 3 * k;
            real now = AT(X, q), predicted = AT(XP, q), y = c1 * AT(X1, q) - c2 * AT(X2, q);
            if (k == 0) {
              const int q1 = q + N;
              now = (AT(X, q1) - now) / ds; predicted = (AT(XP, q1) - predicted) / ds;
              y = (c1 * AT(X1, q1) - c2 * AT(X2, q1) - y) / ds;
            }
            x[k][c] = now; xp[k][c] = predicted; xt[k][c] = (now - y) * ibh;
          }
        }
        real C[3][3], Cp[3][3], l2[3];  // cofactors, predicted squares
        for (int k = 0; k < 3; ++k) {
          cross(x[(k + 1) % 3], x[(k + 2) % 3], C[k]); cross(xp[(k + 1) % 3], xp[(k + 2) % 3], Cp[k]);
          l2[k] = dot(xp[k], xp[k]);
        }
        const real J = dot(x[0], C[0]), Jp = dot(xp[0], Cp[0]);
        const real p = lam * (J - (SC)1) - mu;
        const real pc = minimum(maximum(p, (SC)-1.5 * mu), (SC)0.25 * mu);
        // the same coefficient at the predicted state, bounded so that no rate gains energy
        const real longest = maximum(maximum(l2[0], l2[1]), maximum(l2[2], zero + (SC)1e-6));
        const real bound = mu / SQRT(longest);
        const real pv = minimum(maximum(lam * (Jp - (SC)1) - mu, -bound), bound);
        const real Jt = dot(Cp[0], xt[0]) + dot(Cp[1], xt[1]) + dot(Cp[2], xt[2]);
        const real dh = d * ibh, dsh = dh * s, volumetric = bulk + s * mu / (SC)3;
        real turned[3][3];  // d2J applied to the rates
        for (int k = 0; k < 3; ++k) {
          const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
          real u[3], v[3];
          cross(xt[k1], xp[k2], u); cross(xp[k1], xt[k2], v);
          for (int c = 0; c < 3; ++c) turned[k][c] = u[c] + v[c];
        }

        real f[3][3];
        for (int k = 0; k < 3; ++k) for (int c = 0; c < 3; ++c)
          f[k][c] = volume * (mu * x[k][c] + p * C[k][c]
                    + d * (volumetric * Jt * Cp[k][c] + s * (mu * xt[k][c] + pv * turned[k][c])));
        for (int c = 0; c < 3; ++c) {
          const real fg = f[0][c] / ds;
          r[c] -= fg; r1[c] += fg; r[3 + c] += f[1][c]; r[6 + c] += f[2][c];
          if (i == MID - 1) residual_mid[c] = fg;
          if (i == MID) residual_mid[c] -= fg;
        }
        // Hessian in (g, a, b), lower blocks k >= l
        for (int k = 0; k < 3; ++k) for (int l = 0; l <= k; ++l) {
          real K[3][3];
          for (int m = 0; m < 3; ++m) for (int n = 0; n < 3; ++n)
            K[m][n] = lam * C[k][m] * C[l][n] + dh * volumetric * Cp[k][m] * Cp[l][n];
          if (k == l) {
            for (int m = 0; m < 3; ++m) K[m][m] += mu + dsh * mu;
          } else {
            const int o = 3 - k - l;                                  // the third column
            const real sign = (l + 1) % 3 == k ? one : -one;          // by the order of the columns
            real z[3]; for (int c = 0; c < 3; ++c) z[c] = sign * (pc * x[o][c] + dsh * pv * xp[o][c]);
            K[0][1] -= z[2]; K[0][2] += z[1]; K[1][0] += z[2]; K[1][2] -= z[0]; K[2][0] -= z[1]; K[2][1] += z[0];
          }
          for (int m = 0; m < 3; ++m) for (int n = 0; n < 3; ++n) {
            const real v = volume * K[m][n];
            if (k == 0) { const real u = v / (ds * ds); D[m][n] += u; D1[m][n] += u; O[m][n] -= u; }
            else if (l == 0) { const real u = v / ds; D[3 * k + m][n] -= u; O[n][3 * k + m] += u; }
            else D[3 * k + m][3 * l + n] += v;
          }
        }
        // ---- joints; 0, 1 are a, b of the side before, 2, 3 of the side after. One side may be a frame that
        // does not move: a clamp, or the fingers, which hold the middle node's direction while they hold it
        for (int kind = 0; kind < 4; ++kind) {  // 0: to the next edge, 1: clamp before, 2: fingers after, 3: before
          if ((kind == 1 && i != 0) || (kind == 2 && i != MID - 1) || (kind == 3 && i != MID)) continue;
          const int frame = kind == 0 ? -1 : (kind == 1 ? 0 : 12);
          const bool fixed_before = kind == 1 || kind == 3, fixed_after = kind == 2;
          real y[4][3], yp[4][3], yt[4][3];
          for (int v = 0; v < 4; ++v) for (int c = 0; c < 3; ++c) {
            const bool fixed = v < 2 ? fixed_before : fixed_after;
            const int layer = v < 2 || fixed_before ? i : i + 1, j = layer * N + 3 + 3 * (v % 2) + c;
            if (fixed) { y[v][c] = yp[v][c] = zero + clamp.data[frame + 3 * (v % 2) + c]; yt[v][c] = zero; }
            else {
              y[v][c] = AT(X, j); yp[v][c] = AT(XP, j);
              yt[v][c] = (y[v][c] - (c1 * AT(X1, j) - c2 * AT(X2, j))) * ibh;
            }
          }
          real tw[4][3];  // gradient of the twist; tau is bilinear, so that tw.y counts it twice
          for (int c = 0; c < 3; ++c) {
            tw[0][c] = (SC)-0.5 * yp[3][c]; tw[1][c] = (SC)0.5 * yp[2][c];
            tw[2][c] = (SC)0.5 * yp[1][c]; tw[3][c] = (SC)-0.5 * yp[0][c];
          }
          real twist = (SC)-0.5 * (dot(yp[2], yp[1]) - dot(yp[3], yp[0])), size = zero;
          for (int v = 0; v < 4; ++v) {
            twist += dot(tw[v], y[v]) + d * s * dot(tw[v], yt[v]); size += dot(tw[v], tw[v]);
          }
          const SC apart = (SC)0.5 * (kind > 0 || i == L - 2 ? ds : ds + edge[i + 1]);  // a fixed frame is half an edge away
          real weight = one;
          if ((kind == 1 && !first_clamped) || (kind == 0 && i == L - 2 && !last_clamped)) weight = zero;
          if (kind == 0 && i == MID - 1) weight = weight * (one - gripped);
          if (kind > 1) weight = weight * gripped;
          const real k = mu * (weight * area / apart), kb = k * cb;
          const real kt = minimum((SC)2 * (kb - k * ct), (SC)1.9 * kb / maximum(size, zero + (SC)1e-3));
          const real hb = kb * (one + dsh), ht = kt * (one + dsh);
          for (int v = 0; v < 4; ++v) {
            if (v < 2 ? fixed_before : fixed_after) continue;
            for (int c = 0; c < 3; ++c) {
              const int w = (v + 2) % 4;
              const real force = kb * (y[v][c] - y[w][c] + d * s * (yt[v][c] - yt[w][c])) - kt * twist * tw[v][c];
              const int m = 3 + 3 * (v % 2) + c;
              const bool here = v < 2 || fixed_before;
              if (here) { r[m] += force; D[m][m] += hb; } else { r1[m] += force; D1[m][m] += hb; O[m][m] -= hb; }
              for (int u = 0; u <= v; ++u) {
                if (u < 2 && fixed_before) continue;
                for (int n = 0; n < 3; ++n) {
                  const real value = -ht * tw[v][c] * tw[u][n];
                  const int m2 = 3 + 3 * (u % 2) + n;
                  if (here) D[m][m2] += value; else if (u < 2) O[m][m2] += value; else D1[m][m2] += value;
                }
              }
            }
          }
        }
      }
      // prescribed: the nodes in the clamps, the far clamp's directors, the held node
      if (i == 0 || i == L - 1) {
        // the layer of the last clamp has no edge of its own: its directors are the clamp's
        const int begin = (i == 0 ? first_clamped : last_clamped) ? 0 : 3;
        for (int m = begin; m < (i == 0 ? 3 : N); ++m) {
          r[m] = eliminated[m] = zero;
          for (int n = 0; n < N; ++n) { D[m][n] = zero; D[n][m] = zero; O[n][m] = zero; }
          D[m][m] = one;
        }
      }
      if (i == L - 2) for (int m = last_clamped ? 0 : 3; m < N; ++m) { r1[m] = zero; for (int n = 0; n < N; ++n) O[m][n] = zero; }
      if (i == MID) {
        for (int m = 0; m < 3; ++m) { for (int n = 0; n < 6; ++n) at_mid[n][m] = D[3 + n][m]; for (int n = 0; n < 3; ++n) after_mid[n][m] = O[n][m]; }
        for (int m = 0; m < 3; ++m) {
          // open pads hold the band back with what friction they have left
          if (hold == 2) r[m] += capacity * AT(LANE, 1 + m);
          r[m] = r[m] * freed; eliminated[m] = eliminated[m] * freed;
          for (int n = 0; n < N; ++n) { if (n != m) { D[m][n] = D[m][n] * freed; D[n][m] = D[n][m] * freed; } O[n][m] = O[n][m] * freed; }
          D[m][m] = D[m][m] * freed + attached;
        }
      }
      if (i == MID - 1) for (int m = 0; m < 3; ++m) for (int n = 0; n < N; ++n) { before_mid[m][n] = O[m][n]; O[m][n] = O[m][n] * freed; }

      for (int m = 0; m < N; ++m) {
        const real f = r[m] - eliminated[m];
        imbalance = maximum(imbalance, magnitude(f) / (m < 3 ? (SC)1 : mean_edge)); poison += f * zero;
      }

      // LDL' of the block, then Schur complement into the next layer
      real inverse[N];
      for (int m = 0; m < N; ++m) {
        for (int n = 0; n < m; ++n) { real v = D[m][n]; for (int k = 0; k < n; ++k) v -= D[m][k] * D[n][k]; D[m][n] = v; }
        const real whole = magnitude(D[m][m]);
        real v = D[m][m];
        for (int n = 0; n < m; ++n) { const real u = D[m][n] * inverse[n]; v -= u * D[m][n]; D[m][n] = u; }
        indefinite = v > zero ? indefinite : one;
        inverse[m] = one / (magnitude(v) > (SC)1e-7 * whole ? v : whole);
        real z = r[m]; for (int k = 0; k < m; ++k) z -= D[m][k] * r[k]; r[m] = z;
      }
      if (i < L - 1) {
        for (int m = 0; m < N; ++m) for (int k = 1; k < N; ++k) { real v = O[m][k]; for (int j = 0; j < k; ++j) v -= D[k][j] * O[m][j]; O[m][k] = v; }
        for (int m = 0; m < N; ++m) {
          real row[N], v = r1[m];
          for (int k = 0; k < N; ++k) { row[k] = O[m][k] * inverse[k]; v -= row[k] * r[k]; }
          eliminated[m] = v - r1[m]; r1[m] = v;
          for (int n = 0; n <= m; ++n) { real u = D1[m][n]; for (int k = 0; k < N; ++k) u -= row[k] * O[n][k]; D1[m][n] = u; }
        }
      }
      int at = i * LAYER_WORK;
      for (int m = 0; m < N; ++m) for (int n = 0; n < N; ++n) AT(WORK, at++) = O[m][n];
      for (int m = 0; m < N; ++m) { for (int n = 0; n < m; ++n) AT(WORK, at++) = D[m][n]; AT(WORK, at++) = inverse[m]; }
      for (int m = 0; m < N; ++m) AT(WORK, at++) = r[m];
    }
    // back substitution; the change of a layer stays in the work array
    real dx[N], z[N];
    change = zero;
    for (int i = L - 1; i >= 0; --i) {
      const int o = i * LAYER_WORK, l = o + N * N, v = l + N * (N + 1) / 2;
      for (int m = 0; m < N; ++m) z[m] = AT(WORK, v + m);
      for (int m = 0; m < N; ++m) z[m] = z[m] * AT(WORK, l + m * (m + 1) / 2 + m);
      if (i < L - 1) for (int m = 0; m < N; ++m) {
        real u = zero;
        for (int k = 0; k < N; ++k) u += AT(WORK, o + k * N + m) * dx[k];
        z[m] -= u * AT(WORK, l + m * (m + 1) / 2 + m);
      }
      for (int m = N - 1; m >= 0; --m) for (int n = 0; n < m; ++n) z[n] -= AT(WORK, l + m * (m + 1) / 2 + n) * z[m];
      for (int m = 0; m < N; ++m) {
        dx[m] = z[m]; AT(WORK, v + m) = z[m];
        poison += z[m] * zero;
        change = maximum(change, magnitude(z[m]) * (m < 3 ? (SC)1 : mean_edge));  // a director counts as a turn of its edge
      }
    }
    // lanes that have settled stay as they are, so that a lane never depends on its neighbours
    change += poison; imbalance += poison;
    // a step that an indefinite Hessian gives, or that goes far, is not made: the Hessian is shifted
    const real refused = maximum(change < zero + (SC)5 * step_limit ? zero : one, change < zero + (SC)2 * tolerance ? zero : indefinite);
    const real enough = tolerance * (shift > zero ? zero + (SC)10 : one);
    shift = refused > zero ? maximum((SC)4 * shift, zero + (SC)0.25) : (shift < zero + (SC)0.05 ? zero : (SC)0.5 * shift);
    const real scale = (one - settled) * (one - refused) * minimum(one, step_limit / maximum(change, zero + (SC)1e-12));
    for (int i = 0; i < L; ++i) {
      const int v = i * LAYER_WORK + N * N + N * (N + 1) / 2;
      for (int m = 0; m < N; ++m) { const real u = scale * AT(WORK, v + m); AT(X, i * N + m) -= scale > zero ? u : zero; }
    }
    // the held node's reaction after this step, to first order: it has no unknowns of its own
    for (int m = 0; m < 3; ++m) {
      const int v = MID * LAYER_WORK + N * N + N * (N + 1) / 2;
      real u = zero;
      for (int n = 0; n < N; ++n) u += before_mid[m][n] * AT(WORK, v - LAYER_WORK + n);
      for (int n = 0; n < 6; ++n) u += at_mid[n][m] * AT(WORK, v + 3 + n);
      for (int n = 0; n < 3; ++n) u += after_mid[n][m] * AT(WORK, v + LAYER_WORK + n);
      reaction[m] = settled > zero ? reaction[m] : residual_mid[m] - scale * u;
    }
    settled = change < enough ? maximum(settled, one - refused) : settled;
    settled = imbalance < balance ? one : settled;
    if (ALL(settled > zero)) break;
  }
  // a lane that did not converge, or is no number, has failed for good
  const real bad = settled > zero ? zero : one;
  AT(LANE, 5) = failure != zero ? AT(LANE, 5) : zero + (SC)step;
  failure = failure != zero ? failure : bad;

  // the force of the band on the hand, and whether the pads still hold it
  real force[3];
  for (int c = 0; c < 3; ++c) force[c] = -reaction[c];
  if (hold == 1) {
    const real pull = SQRT(dot(force, force));
    failure = failure != zero ? failure : (SC)2 * (pull > capacity ? one : zero);  // slipped out of closed fingers
    AT(LANE, 15) = pull;
    for (int c = 0; c < 3; ++c) AT(LANE, 1 + c) = force[c] / maximum(pull, zero + (SC)1e-9);
  }
  if (hold == 2) for (int c = 0; c < 3; ++c) force[c] = capacity * AT(LANE, 1 + c);
  if (hold == 0) for (int c = 0; c < 3; ++c) force[c] = zero;
  for (int c = 0; c < 3; ++c) AT(OUT, 4 * step + c) = force[c];

  // the projectile leaves at the first pull: contact = m (acceleration + gravity) along the launch direction
  if (hold == 0 && payload_steps > 0) {
    real contact = zero, position[3], velocity[3];
    for (int c = 0; c < 3; ++c) {
      const int j = MID * N + c;
      const real y = c1 * AT(X1, j) - c2 * AT(X2, j), yv = c1 * AT(V1, j) - c2 * AT(V2, j);
      position[c] = AT(X, j); velocity[c] = (position[c] - y) * ibh;
      contact += payload * ((velocity[c] - yv) * ibh + (c == 2 ? gravity : (SC)0)) * AT(LANE, 1 + c);
    }
    AT(OUT, 4 * step + 3) = contact;
    const real before = step > first_free ? AT(OUT, 4 * step - 1) : contact;
    real w = before / maximum(before - contact, zero + (SC)1e-9);
    w = minimum(maximum(w, zero), one);
    const real leaves = (payload > zero ? one : zero) * (contact > zero ? zero : one);
    for (int c = 1; c < 3; ++c) {
      const int j = MID * N + c;
      AT(LANE, 10 + c) = leaves > zero ? AT(X1, j) + w * (position[c] - AT(X1, j)) : AT(LANE, 10 + c);
      AT(LANE, 12 + c) = leaves > zero ? AT(V1, j) + w * (velocity[c] - AT(V1, j)) : AT(LANE, 12 + c);
    }
    AT(LANE, 10) = leaves > zero ? time - ((SC)1 - w) * h : AT(LANE, 10);
    payload = leaves > zero ? zero : payload;
    failure = failure != zero ? failure : -leaves;  // done: -1 marks a finished launch
  }

  // centre lines (with a frame_width of 9 all unknowns) at the camera's stamps within this step
  for (int k = frame_first.data[step]; k < frame_first.data[step + 1]; ++k) {
    const SC w = frame_weight.data[k];
    for (int i = 0; i < L; ++i) for (int c = 0; c < frame_width; ++c) {
      const int j = i * N + c;
      AT(FRAME, (k * L + i) * frame_width + c) = AT(X1, j) + w * (AT(X, j) - AT(X1, j));
    }
  }
  for (int j = 0; j < L * N; ++j) {
    const real y = c1 * AT(X1, j) - c2 * AT(X2, j), now = AT(X, j);
    const real v = mode == 0 ? zero : (now - y) * ibh;
    AT(X2, j) = mode == 0 ? now : AT(X1, j); AT(X1, j) = now;
    AT(V2, j) = mode == 0 ? zero : AT(V1, j); AT(V1, j) = v;
  }
  AT(OUT, 4 * step + 3) = payload_steps > 0 ? AT(OUT, 4 * step + 3) : zero + (SC)iteration;
  if (payload_steps > 0 && ALL(failure != zero)) break;
}
AT(LANE, 0) = attached; AT(LANE, 4) = failure; AT(LANE, 9) = payload;

#undef N
#undef LAYER_WORK
#undef ROW
#undef AT
#undef SQRT
#undef ALL
