// The element: linear tetrahedra, a solid cylinder in cross-sections.
//
// Cross-section i has N / 3 vertices, the centre first: their places are its degrees of freedom. Between two sections lie the
// tetrahedra of cylinder.py. In each the deformation gradient is constant, F = sum_a x_a grad_a over its corners,
// of the material of material.h, and so are the nodal forces V P grad_a. Nothing else stores energy: bending and
// twist are what the tetrahedra make of them. Coarse ones lock: reports/simulator.md says how much.
//
// Clamps and the hand hold whole sections, so that none of their vertices has an equation. A point force on a vertex would
// only dent the mesh. What of the band lies inside the clamps does not deform, and needs no sections.
//
// For the CPU alone: 21 degrees of freedom a cross-section are more than a GPU's shared memory holds.
// Wants the macros TETS (in a slab, between two sections) and CORNERS (of each, among the slab's vertices).

const int PLACES = N, VERTICES = N / 3;
const int corners[TETS][4] = CORNERS;
// after the edges' lengths: share of each vertex in a section's mass, its place across the band, and of a
// slab 1 m long the volumes of the tetrahedra and the gradients of their corners
const SC* shares = edge + L - 1;
const SC* sections = shares + VERTICES;
const SC* volumes = sections + 2 * VERTICES;
const SC* gradients = volumes + TETS;

auto share = [&](int m) -> SC { return shares[m / 3]; };
auto in_hand = [&](int m) -> SC {  // the section lies in the fingers' frame
  const SC* frame = clamp.data + 12;
  return sections[m / 3 * 2] * frame[m % 3] + sections[m / 3 * 2 + 1] * frame[3 + m % 3];
};
auto moves = [&](int i, int) -> bool {
  return i == 0 ? !first_clamped : i == L - 1 ? !last_clamped : !(i == MID && attached);
};
auto mass_of = [&](int i, int m) -> real {
  const SC length = (SC)0.5 * ((i ? edge[i - 1] : (SC)0) + (i < L - 1 ? edge[i] : (SC)0));
  return share(m) * (zero + line_mass * length + (i == MID ? payload : zero));
};

// a staged section: Hessian of its own degrees of freedom, of the next section's, and across, by columns (on the diagonal the lower
// triangle); residual of this section and of the next
real own[N][N], following[N][N], across[N][N], force_here[N], force_there[N];
#define RESIDUAL(m, j) force_here[m]
#define RESIDUAL_NEXT(m, j) force_there[m]
// of the slabs on both sides of the hand: force on the held section, and what it has of the other section's degrees of freedom
real hand_terms[2][3], hand_terms_of[2][3][N];

// drag of the air on the moving band, which the projectile does not feel
auto wind_of = [&](int i, int m) -> real { return air * (mass_of(i, m) - (i == MID ? share(m) * payload : zero)); };
auto update_air_drag = [](bool) {};  // a cylinder's drag: the rod alone knows it
auto wind_on = [&](int i, int m) -> real { return wind_of(i, m) * (X(m, i) - Y(m, i)); };
auto hand_force = [&](int c, real scale) -> real {  // on the held section, after Newton's change times `scale`, to first order
  real force = hand_terms[0][c] + hand_terms[1][c];
  for (int m = c; m < N; m += 3) force += mass_of(MID, m) * ibh2 * (X(m, MID) - XH(m, MID)) + wind_on(MID, m);
  for (int m = 0; m < N; ++m)
    force -= scale * (hand_terms_of[0][c][m] * DX(m, MID - 1) + hand_terms_of[1][c][m] * DX(m, MID + 1));
  return force;
};

// energy of the slab between the sections i and i + 1
auto stage_slab = [&](int i) {
  const SC ds = edge[i], per_ds = (SC)1 / ds;
  real x[2 * VERTICES][3], xp[2 * VERTICES][3], xt[2 * VERTICES][3];  // now, predicted, rate
  for (int v = 0; v < 2 * VERTICES; ++v) UNROLL for (int c = 0; c < 3; ++c) {
    const int m = 3 * (v % VERTICES) + c, section = i + v / VERTICES;
    x[v][c] = X(m, section); xp[v][c] = XP(m, section); xt[v][c] = (x[v][c] - Y(m, section)) * ibh;
  }
  for (int t = 0; t < TETS; ++t) {
    SC grad[4][3];
    real F[3][3], Fp[3][3], Ft[3][3], stress[3][3], K[6][3][3];
    UNROLL for (int k = 0; k < 3; ++k) {
      UNROLL for (int a = 0; a < 4; ++a) grad[a][k] = gradients[(4 * t + a) * 3 + k] * (k ? (SC)1 : per_ds);
      UNROLL for (int c = 0; c < 3; ++c) {
        F[k][c] = Fp[k][c] = Ft[k][c] = zero;
        UNROLL for (int a = 0; a < 4; ++a) {
          const int v = corners[t][a];
          F[k][c] += grad[a][k] * x[v][c]; Fp[k][c] += grad[a][k] * xp[v][c]; Ft[k][c] += grad[a][k] * xt[v][c];
        }
      }
    }
    // locked tetrahedra have pressures of either sign
    material(F, Fp, Ft, (SC)-20, (SC)20, one, stress, K);
    const SC volume = volumes[t] * ds;
    for (int b = 0; b < 4; ++b) {
      const int vb = corners[t][b] % VERTICES, above_b = corners[t][b] / VERTICES;
      real row[3][3][3];  // derivative of the stress by corner b, times the volume
      UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int m = 0; m < 3; ++m) {
        (above_b ? force_there : force_here)[3 * vb + m] += volume * grad[b][k] * stress[k][m];
        if (!fresh) continue;
        UNROLL for (int n = 0; n < 3; ++n) {
          row[k][m][n] = zero;
          UNROLL for (int l = 0; l < 3; ++l)
            row[k][m][n] += volume * grad[b][l] * (k >= l ? K[k * (k + 1) / 2 + l][m][n] : K[l * (l + 1) / 2 + k][n][m]);
        }
      }
      for (int a = 0; fresh && a < 4; ++a) {
        const int va = corners[t][a] % VERTICES, above_a = corners[t][a] / VERTICES;
        if (above_a > above_b || (above_a == above_b && va < vb)) continue;  // its transpose is counted
        auto& block = above_a ? following : above_b ? across : own;
        UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n < 3; ++n)
          block[3 * vb + n][3 * va + m] += grad[a][0] * row[0][m][n] + grad[a][1] * row[1][m][n] + grad[a][2] * row[2][m][n];
      }
    }
  }
  if (i == MID - 1 || i == MID) for (int c = 0; c < 3; ++c) {
    const int side = i - MID + 1;
    hand_terms[side][c] = zero;
    for (int m = c; m < N; m += 3) hand_terms[side][c] += side ? force_here[m] : force_there[m];
    for (int n = 0; fresh && n < N; ++n) {
      hand_terms_of[side][c][n] = zero;
      for (int m = c; m < N; m += 3) hand_terms_of[side][c][n] += side ? across[n][m] : across[m][n];
    }
  }
};

auto stage_section = [&](int i) {
  for (int c = 0; c < N; ++c) {
    for (int m = 0; fresh && m < N; ++m) own[c][m] = following[c][m] = across[c][m] = zero;
    force_here[c] = force_there[c] = zero;
  }
  if (i < L - 1) stage_slab(i);
  for (int m = 0; m < N; ++m) {
    const real mass = mass_of(i, m);
    force_here[m] += mass * ibh2 * (X(m, i) - XH(m, i)) + wind_on(i, m);
    if (fresh) own[m][m] += mass * ibh2 + wind_of(i, m) + shift * (node_shift * share(m));
  }
};

// as rod.h's
auto hessian_column = [&](int, int c, real* D, real* U, real* carry) {
  if (c == N) {
    for (int m = 0; m < N; ++m) { U[m] = force_here[m]; carry[m] = force_there[m]; }
    return;
  }
  for (int m = 0; m < N; ++m) { D[m] = own[c][m]; U[m] = across[c][m]; carry[m] = following[c][m]; }
};
