// Newton's system: the Hessian is block-tridiagonal, a block N x N a section,
//
//   | A0  B0'         | | x0 |   | f0 |
//   | B0  A1  B1'     | | x1 |   | f1 |      eliminated:  D0 = A0,  D1 = A1 - B0 D0^-1 B0',  ...
//   |     B1  A2  B2' | | x2 | = | f2 |      U0 = B0',  U1 = B1',  ...
//   |         ..  ..  | | .. |   | .. |
//
// It is eliminated from the first section to the last (D = L diag L' of each block; Schur complement into the next) and
// substituted back; by two chains, from both ends to the middle, where what both leave is added.
//
// A thread has COLUMNS columns of a block: of D, of U, and of `next`, what goes into the next section's D. Column N of U
// and `next` is the residual f.

real change = zero, imbalance = zero;         // longest entry of Newton's step [m]; largest residual [N]
real indefinite = zero, poison = zero;        // whether a pivot is not positive; no number as soon as anything is

// the residual of section i, before elimination mixes it; `before` is what the one before it adds
auto weigh = [&](int i, real (&before)[N]) {
  UNROLL for (int m = 0; m < N; ++m) {
    const real f = RESIDUAL(m, i) + before[m];
    if (moves(i, m)) { imbalance = maximum(imbalance, magnitude(f) * (m < 3 ? (SC)1 : per_edge)); poison += f * zero; }
  }
};

// my columns of section i, of which `next` has what the sections before left
auto take = [&](int i, real (&D)[COLUMNS][N], real (&U)[COLUMNS][N], real (&next)[COLUMNS][N]) {
  const bool met = CHAINS == 2 && i == MID;
  // some degrees of freedom there may have no equation
  const bool special = i == 0 || i == MID - 1 || i == MID || i == (CHAINS == 2 ? MID + 1 : MID) || i >= L - 2;
  const int after = down ? i - 1 : i + 1;
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + mine;
    real carry[N];
    hessian_column(i, c, D[q], U[q], carry);
    if (down) UNROLL for (int m = 0; m < N; ++m) { next[q][m] += met ? zero : carry[m]; carry[m] = zero; }
    if (c < N) { UNROLL for (int m = FIRST_ROW(c); m < N; ++m) D[q][m] += next[q][m]; }
    else { UNROLL for (int m = 0; m < N; ++m) U[q][m] += next[q][m]; }
    // opening pads hold the band back with what friction they have left
    if (i == MID && opening && c >= N) UNROLL for (int m = 0; m < 3; ++m) U[q][m] += capacity * direction[m];
    if (special) {
      const bool here = c >= N || moves(i, c), there = c >= N || (!met && after < L && moves(after, c));
      UNROLL for (int m = 0; m < N; ++m) {
        if (!moves(i, m) || !here) D[q][m] = m == c ? one : zero;
        if (!moves(i, m) || !there) U[q][m] = zero;
      }
    }
    UNROLL for (int m = 0; m < N; ++m) next[q][m] = carry[m];
  }
};

// LDL' of the block: D becomes the multipliers below its diagonal, `inverse` 1 / pivot; U is solved forwards with it.
// A chain does both at once, pivot by pivot; a thread alone takes U column by column, which stay in its registers
auto factorise = [&](real (&D)[COLUMNS][N], real (&U)[COLUMNS][N], real (&inverse)[N], real (&own_inverse)[COLUMNS]) {
  UNROLL for (int k = 0; k < N; ++k) {
    const real pivot = OF(D, k, k);
    indefinite = pivot > zero ? indefinite : one;
    inverse[k] = one / pivot;
    real multiplier[N];
    UNROLL for (int m = k + 1; m < N; ++m) multiplier[m] = OF(D, k, m) * inverse[k];
#if COLUMNS == 1
    const real a = mine > k ? D[0][k] : zero;
    UNROLL for (int m = k + 1; m < N; ++m) {
      D[0][m] = mine == k ? multiplier[m] : D[0][m] - multiplier[m] * a;
      U[0][m] -= multiplier[m] * U[0][k];
    }
    own_inverse[0] = mine == k || k == 0 ? inverse[k] : own_inverse[0];
#else
    UNROLL for (int c = k + 1; c < N; ++c) UNROLL for (int m = c; m < N; ++m) D[c][m] -= multiplier[m] * D[k][c];
    UNROLL for (int m = k + 1; m < N; ++m) D[k][m] = multiplier[m];
    own_inverse[k] = inverse[k];
#endif
  }
#if COLUMNS > 1
  UNROLL for (int q = 0; q < COLUMNS; ++q)
    UNROLL for (int k = 0; k < N; ++k) UNROLL for (int m = k + 1; m < N; ++m) U[q][m] -= D[k][m] * U[q][k];
#endif
};

// Schur complement into the next section; what the back substitution needs is kept
auto complement = [&](int at, real (&D)[COLUMNS][N], real (&U)[COLUMNS][N], real (&inverse)[N], real (&own_inverse)[COLUMNS],
                      real (&next)[COLUMNS][N]) {
  SHARE(U);
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + mine;
    real scaled[N];
    UNROLL for (int k = 0; k < N; ++k) scaled[k] = U[q][k] * inverse[k];
    UNROLL for (int n = FIRST_ROW(c < N ? c : 0); n < N; ++n) {
      real sum = next[q][n];
      UNROLL for (int k = 0; k < N; ++k) sum -= SHARED(n, k) * scaled[k];
      next[q][n] = sum;
    }
    if (c < N) {
      UNROLL for (int m = 1; m < N; ++m) if (m > FIRST_ROW(c)) KEEP(at, m, q) = D[q][m];
      UNROLL for (int m = 0; m < N; ++m) KEEP(at, N + m, q) = SHARED(m, c) * own_inverse[q];
      KEEP(at, 2 * N, q) = SHARED(N, c) * own_inverse[q];
      if (AGAIN) KEEP(at, 2 * N + 1, q) = own_inverse[q];
    }
  }
};

auto substitute = [&]() {
  real after[COLUMNS];  // of the chain's section after this one
  UNROLL for (int q = 0; q < COLUMNS; ++q) after[q] = zero;
  BEGIN_KEPT;
  for (int at = LAST; at >= 0; --at) {
    NEXT_KEPT(at);
    real x[COLUMNS];
    UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
      x[q] = KEPT(at, 2 * N, q);
      if (at < LAST) UNROLL for (int m = 0; m < N; ++m) x[q] -= KEPT(at, N + m, q) * AT_MEMBER(after, m);
    }
    UNROLL for (int k = N - 1; k > 0; --k) {
      const real known = AT_MEMBER(x, k);
      UNROLL for (int q = 0; q < OWN_ROWS; ++q) if (q + mine < k) x[q] -= KEPT(at, k, q) * known;
    }
    UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
      const int c = q + mine;
      after[q] = x[q];
      if (c < N) {
        DX(c, SECTION(at)) = x[q];
        poison += x[q] * zero;
        change = maximum(change, magnitude(x[q]) * (c < 3 ? (SC)1 : mean_edge));  // a director counts as a turn of its edge
      }
    }
  }
};

#if AGAIN
// the residual alone of section i, through the factors that are kept; `next` as for `take`
auto eliminate_again = [&](int i, real (&next)[OWN_ROWS]) {
  real x[OWN_ROWS];
  UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
    const int c = q + mine;
    x[q] = c < N && moves(i, c) ? RESIDUAL(c, i) + next[q] : zero;
    if (i == MID && opening && c < 3) x[q] += capacity * direction[c];
    next[q] = c < N ? RESIDUAL_NEXT(c, i) : zero;
  }
  UNROLL for (int k = 0; k < N; ++k) {
    const real known = AT_MEMBER(x, k);
    UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
      const int c = q + mine;
      if (c > k && c < N) x[q] -= KEEP(i, c, k) * known;
      if (c < N) next[q] -= KEEP(i, N + c, k) * known;
    }
  }
  UNROLL for (int q = 0; q < OWN_ROWS; ++q) if (q + mine < N) KEEP(i, 2 * N, q) = x[q] * KEEP(i, 2 * N + 1, q);
};
#endif

// Newton's step from the state X into DX; unless `fresh`, with the Hessian of the solve before
auto solve = [&]() {
  real D[COLUMNS][N], U[COLUMNS][N], next[COLUMNS][N], inverse[N], own_inverse[COLUMNS], before[N], again[OWN_ROWS];
  change = imbalance = poison = zero;
  if (fresh) indefinite = inexact = zero;
  UNROLL for (int q = 0; q < COLUMNS; ++q) UNROLL for (int m = 0; m < N; ++m) next[q][m] = zero;
  UNROLL for (int m = 0; m < N; ++m) before[m] = zero;
  UNROLL for (int q = 0; q < OWN_ROWS; ++q) again[q] = zero;
#if CHAINS == 2
  SYNC;
  for (int i = member; i < L; i += T) stage_section(i);
  SYNC;
  for (int i = member; i < L; i += T) {
    UNROLL for (int m = 0; m < N; ++m) before[m] = i ? RESIDUAL_NEXT(m, i - 1) : zero;
    weigh(i, before);
  }
#endif
  for (int at = 0; at <= LAST; ++at) {
    const int i = SECTION(at);
#if CHAINS == 2
    if (i == MID) {  // the other chain's thread with this column
      const int other = member < 2 * (N + 1) ? (member + N + 1) % (2 * (N + 1)) : member;
      UNROLL for (int m = 0; m < N; ++m) next[0][m] += __shfl_sync(~0u, next[0][m], other);
    }
#else
    stage_section(i);
    weigh(i, before);
    UNROLL for (int m = 0; m < N; ++m) before[m] = RESIDUAL_NEXT(m, i);
    if (!fresh) { eliminate_again(i, again); continue; }
#endif
    take(i, D, U, next);
    factorise(D, U, inverse, own_inverse);
    complement(at, D, U, inverse, own_inverse, next);
  }
  substitute();
  change = poison == zero ? change : zero + (SC)1e30;
  imbalance = poison == zero ? imbalance : zero + (SC)1e30;
  change = team_maximum(change); imbalance = team_maximum(imbalance);
  inexact = team_maximum(inexact); indefinite = team_maximum(indefinite);
  SYNC;
};
