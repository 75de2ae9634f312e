// Newton's system. Its unknowns are the changes x_i of all sections' degrees of freedom; f_i are their residuals, and its
// matrix, the Hessian, is block-tridiagonal, a block of DOFS x DOFS a section (rod.h has its parts):
//
//   | A0  B0'         | | x0 |   | f0 |
//   | B0  A1  B1'     | | x1 |   | f1 |      eliminated:  D0 = A0,  D1 = A1 - B0 D0^-1 B0',  ...
//   |     B1  A2  B2' | | x2 | = | f2 |      U0 = B0',  U1 = B1',  ...
//   |         ..  ..  | | .. |   | .. |
//
// A chain eliminates section after section (D = L diag L' of each block; Schur complement into the next) and substitutes
// back. It ends at the section MEET: one chain from the first section to the last, or two from both ends to the middle,
// where what both leave is added. What follows is of this thread's chain and columns; column DOFS of U and of `next`, what
// goes into the next section's D, is the residual f.

const int CHAIN_END = backwards ? SECTIONS - 1 - MEET : MEET;  // number of MEET in this chain
#define SECTION(at) (backwards ? SECTIONS - 1 - (at) : (at))

real change = zero, imbalance = zero;   // longest entry of Newton's step [m]; largest residual [N]
real indefinite = zero, poison = zero;  // whether a pivot is not positive; no number as soon as anything is

auto weigh_residual = [&](int i) {
  UNROLL for (int m = 0; m < DOFS; ++m) {
    const real f = STAGED_FORCE(m, i) + (i ? STAGED_FORCE_NEXT(m, i - 1) : zero);
    if (moves(i, m)) {
      imbalance = maximum(imbalance, magnitude(f) * (m < 3 ? (scalar)1 : per_edge));
      poison += f * zero;
    }
  }
};

// D and U of section i, of which `next` has what the sections before left; then `next` has what is known of the next one
auto take_section = [&](int i, real (&D)[COLUMNS][DOFS], real (&U)[COLUMNS][DOFS], real (&next)[COLUMNS][DOFS]) {
  const bool met = i == MEET;
  const int after = backwards ? i - 1 : i + 1;
  // some degrees of freedom here or there may have no equation
  const bool special = i == 0 || met || i >= SECTIONS - 2 || (i >= MIDDLE - 1 && i <= MIDDLE + 1);
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + first_column;
    own_column(i, c, D[q]);
    coupling_column(i, c, D[q], U[q]);
    if (c < DOFS) { UNROLL for (int m = LOWER_PART_FROM(c); m < DOFS; ++m) D[q][m] += next[q][m]; }
    else { UNROLL for (int m = 0; m < DOFS; ++m) U[q][m] += next[q][m]; }
    // opening pads hold the band back with what friction they have left
    if (i == MIDDLE && opening && c >= DOFS) UNROLL for (int m = 0; m < 3; ++m) U[q][m] += capacity * direction[m];
    if (special) {
      const bool here = c >= DOFS || moves(i, c), there = c >= DOFS || (!met && moves(after, c));
      UNROLL for (int m = 0; m < DOFS; ++m) {
        if (!moves(i, m) || !here) D[q][m] = m == c ? one : zero;
        if (!moves(i, m) || !there) U[q][m] = zero;
      }
    }
    carried_column(backwards ? i - 2 : i, c, next[q]);
    if (backwards && after == MEET) UNROLL for (int m = 0; m < DOFS; ++m) next[q][m] = zero;  // the other chain has it
  }
};

// LDL' of D, whose columns become multipliers below the diagonal; U is solved forwards with it. `inverse`: 1 / pivot
auto factorise = [&](real (&D)[COLUMNS][DOFS], real (&U)[COLUMNS][DOFS], real (&inverse)[DOFS], real (&own_inverse)[COLUMNS]) {
  real multiplier[DOFS][DOFS];
  UNROLL for (int k = 0; k < DOFS; ++k) {
    const real pivot = ENTRY(D, k, k);
    indefinite = pivot > zero ? indefinite : one;
    inverse[k] = one / pivot;
    UNROLL for (int m = k + 1; m < DOFS; ++m) multiplier[k][m] = ENTRY(D, k, m) * inverse[k];
    UNROLL for (int q = COLUMNS - 1; q >= 0; --q) {  // column k last: the others read it
      const int c = q + first_column;
      const real above = ROW_OF_OWN(D, k, q < DOFS ? q : 0);
      UNROLL for (int m = k + 1; m < DOFS; ++m) {
        if (c > k && c < DOFS && m >= LOWER_PART_FROM(c)) D[q][m] -= multiplier[k][m] * above;
        if (c == k) D[q][m] = multiplier[k][m];
      }
      if (c == k) own_inverse[q] = inverse[k];
    }
  }
  UNROLL for (int q = 0; q < COLUMNS; ++q)
    UNROLL for (int k = 0; k < DOFS; ++k) UNROLL for (int m = k + 1; m < DOFS; ++m) U[q][m] -= multiplier[k][m] * U[q][k];
};

// Schur complement into the next section; what the back substitution needs is stored
auto complement = [&](int at, real (&D)[COLUMNS][DOFS], real (&U)[COLUMNS][DOFS], real (&inverse)[DOFS],
                      real (&own_inverse)[COLUMNS], real (&next)[COLUMNS][DOFS]) {
  SHARE_COLUMNS(U, at);
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + first_column;
    real scaled[DOFS];
    UNROLL for (int k = 0; k < DOFS; ++k) scaled[k] = U[q][k] * inverse[k];
    UNROLL for (int n = LOWER_PART_FROM(c < DOFS ? c : 0); n < DOFS; ++n) {
      real sum = next[q][n];
      UNROLL for (int k = 0; k < DOFS; ++k) sum -= SHARED_COLUMN(U, at, n, k) * scaled[k];
      next[q][n] = sum;
    }
    if (c < DOFS) {
      UNROLL for (int m = 1; m < DOFS; ++m) if (m > LOWER_PART_FROM(c)) STORED(at, m, c) = D[q][m];
      UNROLL for (int m = 0; m < DOFS; ++m) STORED(at, STORED_COUPLING + m, c) = SHARED_COLUMN(U, at, m, c) * own_inverse[q];
      STORED(at, STORED_SOLUTION, c) = SHARED_COLUMN(U, at, DOFS, c) * own_inverse[q];
      if (REUSES_FACTORS) STORED(at, STORED_INVERSE, c) = own_inverse[q];
    }
  }
};

// the residual alone of section i, through stored factors; `next`, of the residual, as for `take_section`
auto eliminate_residual = [&](int at, real (&next)[COLUMNS]) {
  const int i = SECTION(at);
  real x[COLUMNS];
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + first_column;
    x[q] = c < DOFS && moves(i, c) ? STAGED_FORCE(c, i) + next[q] : zero;
    if (i == MIDDLE && opening && c < 3) x[q] += capacity * direction[c];
    next[q] = c < DOFS ? STAGED_FORCE_NEXT(c, i) : zero;
  }
  UNROLL for (int k = 0; k < DOFS; ++k) {
    const real known = OF_COLUMN(x, k);
    UNROLL for (int q = 0; q < COLUMNS; ++q) {
      const int c = q + first_column;
      if (c > k && c < DOFS) x[q] -= STORED(at, c, k) * known;
      if (c < DOFS) next[q] -= STORED(at, STORED_COUPLING + c, k) * known;
    }
  }
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + first_column;
    if (c < DOFS) STORED(at, STORED_SOLUTION, c) = x[q] * STORED(at, STORED_INVERSE, c);
  }
};

auto substitute = [&]() {
  real after[COLUMNS];  // of the chain's section after this one
  UNROLL for (int q = 0; q < COLUMNS; ++q) after[q] = zero;
  BEGIN_READING_AHEAD(CHAIN_END);
  for (int at = CHAIN_END; at >= 0; --at) {
    READ_AHEAD(at);
    real x[COLUMNS];
    UNROLL for (int q = 0; q < COLUMNS; ++q) {
      const int c = q + first_column < DOFS ? q + first_column : 0;
      x[q] = READ(at, STORED_SOLUTION, c);
      if (at < CHAIN_END) UNROLL for (int m = 0; m < DOFS; ++m) x[q] -= READ(at, STORED_COUPLING + m, c) * OF_COLUMN(after, m);
    }
    UNROLL for (int k = DOFS - 1; k > 0; --k) {
      const real known = OF_COLUMN(x, k);
      UNROLL for (int q = 0; q < COLUMNS; ++q) if (q + first_column < k) x[q] -= READ(at, k, q + first_column) * known;
    }
    UNROLL for (int q = 0; q < COLUMNS; ++q) {
      const int c = q + first_column;
      after[q] = x[q];
      if (c < DOFS) {
        CHANGE(c, SECTION(at)) = x[q];
        poison += x[q] * zero;
        change = maximum(change, magnitude(x[q]) * (c < 3 ? (scalar)1 : mean_edge));  // a director counts as a turn of its edge
      }
    }
  }
};

// Newton's step from the state NOW into CHANGE; unless `fresh`, with the Hessian of the solve before
auto solve = [&]() INLINED {
  real D[COLUMNS][DOFS], U[COLUMNS][DOFS], next[COLUMNS][DOFS], inverse[DOFS], own_inverse[COLUMNS], next_residual[COLUMNS];
  change = imbalance = poison = zero;
  if (fresh) indefinite = inexact = zero;
  WAIT_FOR_TEAM;
  for (int i = member; i < SECTIONS; i += TEAM) stage_section(i);
  WAIT_FOR_TEAM;
  for (int i = member; i < SECTIONS; i += TEAM) weigh_residual(i);
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    UNROLL for (int m = 0; m < DOFS; ++m) next[q][m] = zero;
    if (backwards) carried_column(SECTIONS - 2, q + first_column, next[q]);
    next_residual[q] = own_inverse[q] = zero;
  }
  for (int at = 0; at <= CHAIN_END; ++at) {
    if (!fresh) { eliminate_residual(at, next_residual); continue; }
    if (SECTION(at) == MEET) join_chains(next);
    take_section(SECTION(at), D, U, next);
    factorise(D, U, inverse, own_inverse);
    complement(at, D, U, inverse, own_inverse, next);
  }
  substitute();
  change = poison == zero ? change : zero + (scalar)1e30;
  imbalance = poison == zero ? imbalance : zero + (scalar)1e30;
  change = team_maximum(change); imbalance = team_maximum(imbalance);
  inexact = team_maximum(inexact); indefinite = team_maximum(indefinite);
  WAIT_FOR_TEAM;
};
