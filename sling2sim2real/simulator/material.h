// The material: stable neo-Hookean without its logarithm (Smith, de Goes, Kim 2018), damped.
//
// With the deformation gradient F = [x0 x1 x2] (columns), J = det F, the energy a unit of volume is
//
//   W = mu/2 (|F|^2 - 3) - mu (J - 1) + lam/2 (J - 1)^2
//
// and the nominal stress mu F + p cof F, p = lam (J - 1) - mu. Viscous stress is d times the rate of the elastic
// stress: the tangent of W at the predicted state, applied to the rates F'. Its shape part is scaled by s, the
// volume part K J'^2 (K = lam - mu/3) is not. p in it is bounded so that every state dissipates: with a bound m on
// the largest principal stretch (the root of the largest row sum of |xk.xl|, exact where nothing shears)
//
//   -mu/m (1 + min(max(J, 0), 1)^2)/2  <=  p  <=  0.7 mu/m
//
//   D = d/2 [ K J'^2 + s ( mu |F'|^2 + p d2J(F', F') + mu/3 J'^2 ) ]
//
// Nominal stress turns with the material, and its rate is not zero where a stressed band only turns: as written, D would
// brake every turn of a taut band. So D is taken at F' - w x F, with the spin w at which it is least: of S = mu F + p cof F
// and tau = F S' (symmetric), (tr tau - tau) w = sum_k S_k x F'_k. A turn costs nothing, a stretch what it did, and every state
// dissipates still. TURNS mu on the diagonal keeps the matrix regular where nothing is stressed. Of all that is taken off so,
// the share `turning` stays: engines that damp the rate of the nominal stress brake turns in full. So does what holds the
// steps where W is not convex, or they would gain energy and not converge: a slack column that turns keeps the brake of a
// material whose s d is HOLDS [s], less and less up to a stretch of TAUT; one turned inside out keeps all.

// F now, predicted, and its rate -> stress (columns) and its derivative, K[k (k + 1) / 2 + l] for columns k >= l,
// exact as long as p / mu is between LEAST and MOST; `shaped` scales s further
#define LEAST -1.5
#define MOST 0.25
#define TURNS 1e-2
#define HOLDS 1e-4
#define TAUT 1.2
auto material = [&](const real (&x)[3][3], const real (&xp)[3][3], const real (&xt)[3][3], real shaped, real (&stress)[3][3], real (&K)[6][3][3]) {
  real C[3][3], Cp[3][3], square = zero;  // cofactors; m squared
  UNROLL for (int k = 0; k < 3; ++k) {
    cross(x[(k + 1) % 3], x[(k + 2) % 3], C[k]); cross(xp[(k + 1) % 3], xp[(k + 2) % 3], Cp[k]);
    const real shear = magnitude(dot(xp[k], xp[(k + 1) % 3])) + magnitude(dot(xp[k], xp[(k + 2) % 3]));
    square = maximum(square, dot(xp[k], xp[k]) + shear);
  }
  const real J = dot(x[0], C[0]), Jp = dot(xp[0], Cp[0]);
  const real p = lam * (J - (scalar)1) - mu;
  // far from rest Newton's method takes a smaller part of what may be negative
  const real pc = minimum(maximum(p, (scalar)LEAST * mu), (scalar)MOST * mu);
  inexact = pc == p ? inexact : one;
  const real bound = mu / SQRT(maximum(square, zero + (scalar)1e-6));
  const real kept = minimum(maximum(Jp, zero), one);
  const real pv = minimum(maximum(lam * (Jp - (scalar)1) - mu, (scalar)-0.5 * bound * (one + kept * kept)), (scalar)0.7 * bound);
  const real Jt = dot(Cp[0], xt[0]) + dot(Cp[1], xt[1]) + dot(Cp[2], xt[2]);
  const real sv = shape_damping * shaped, damp_here = damp_shape * shaped, volumetric = bulk + sv * mu / (scalar)3;
  real S[3][3], A[6], spin[3] = {zero, zero, zero};  // A: 00, 10, 11, 20, 21, 22 of the inverse below
  UNROLL for (int k = 0; k < 3; ++k) {
    real turn[3];
    UNROLL for (int c = 0; c < 3; ++c) S[k][c] = mu * xp[k][c] + pv * Cp[k][c];
    cross(S[k], xt[k], turn);
    UNROLL for (int c = 0; c < 3; ++c) spin[c] += turn[c];
  }
  {
    real tau[6];
    UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n <= m; ++n) {
      real sum = zero;
      UNROLL for (int k = 0; k < 3; ++k) sum += xp[k][m] * S[k][n] + xp[k][n] * S[k][m];
      tau[m * (m + 1) / 2 + n] = (scalar)-0.5 * sum;
    }
    const real trace = (scalar)TURNS * mu - tau[0] - tau[2] - tau[5];
    tau[0] += trace; tau[2] += trace; tau[5] += trace;
    A[0] = tau[2] * tau[5] - tau[4] * tau[4]; A[1] = tau[4] * tau[3] - tau[1] * tau[5]; A[2] = tau[0] * tau[5] - tau[3] * tau[3];
    A[3] = tau[1] * tau[4] - tau[3] * tau[2]; A[4] = tau[3] * tau[1] - tau[0] * tau[4]; A[5] = tau[0] * tau[2] - tau[1] * tau[1];
    const real slack = minimum(maximum((zero + (scalar)TAUT - SQRT(dot(xp[0], xp[0]))) / (scalar)(TAUT - 1), zero), one);
    const real holds = Jp > zero ? slack * minimum(one, (scalar)HOLDS / (damping * shape_damping)) : one;
    const real over = (one - maximum(turning, holds)) / (tau[0] * A[0] + tau[1] * A[1] + tau[3] * A[3]);
    UNROLL for (int m = 0; m < 6; ++m) A[m] *= over;
    const real b[3] = {spin[0], spin[1], spin[2]};
    spin[0] = A[0] * b[0] + A[1] * b[1] + A[3] * b[2];
    spin[1] = A[1] * b[0] + A[2] * b[1] + A[4] * b[2];
    spin[2] = A[3] * b[0] + A[4] * b[1] + A[5] * b[2];
  }
  UNROLL for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    real u[3], v[3], turned[3];  // d2J applied to the rates
    cross(xt[k1], xp[k2], u); cross(xp[k1], xt[k2], v); cross(spin, S[k], turned);
    UNROLL for (int c = 0; c < 3; ++c)
      stress[k][c] = mu * x[k][c] + p * C[k][c]
                   + damping * (volumetric * Jt * Cp[k][c] + sv * (mu * xt[k][c] + pv * (u[c] + v[c]) - turned[c]));
  }
  if (!fresh) return;
  UNROLL for (int l = 0; l < 3; ++l) {
    real turns[3][3];  // turns[n] is the spin that the rate n of column l brings
    const real* a = S[l];
    UNROLL for (int m = 0; m < 3; ++m) {
      const real r0 = A[m ? (m == 1 ? 1 : 3) : 0], r1 = A[m ? (m == 1 ? 2 : 4) : 1], r2 = A[m ? (m == 1 ? 4 : 5) : 3];
      turns[0][m] = damp_here * (r1 * a[2] - r2 * a[1]); turns[1][m] = damp_here * (r2 * a[0] - r0 * a[2]); turns[2][m] = damp_here * (r0 * a[1] - r1 * a[0]);
    }
    UNROLL for (int k = l; k < 3; ++k) UNROLL for (int n = 0; n < 3; ++n) {
      real turned[3];
      cross(turns[n], S[k], turned);
      UNROLL for (int m = 0; m < 3; ++m) K[k * (k + 1) / 2 + l][m][n] = -turned[m];
    }
  }
  UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int l = 0; l <= k; ++l) {
    real (&block)[3][3] = K[k * (k + 1) / 2 + l];
    UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n < 3; ++n)
      block[m][n] += lam * C[k][m] * C[l][n] + damp * volumetric * Cp[k][m] * Cp[l][n];
    if (k == l) {
      UNROLL for (int m = 0; m < 3; ++m) block[m][m] += mu + damp_here * mu;
    } else {
      const int o = 3 - k - l;                                  // the third column
      const real sign = (l + 1) % 3 == k ? one : -one;          // by the order of the columns
      real z[3];
      UNROLL for (int c = 0; c < 3; ++c) z[c] = sign * (pc * x[o][c] + damp_here * pv * xp[o][c]);
      block[0][1] -= z[2]; block[0][2] += z[1]; block[1][0] += z[2]; block[1][2] -= z[0]; block[2][0] -= z[1]; block[2][1] += z[0];
    }
  }
};
