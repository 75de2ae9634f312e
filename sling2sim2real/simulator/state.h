// What a sling is made of, where its numbers are stored, and what holds during a step.

#define SETTING_OF(name) setting.data[SETTING_##name]
const scalar mean_edge = SETTING_OF(MEAN_EDGE), area = SETTING_OF(AREA), radius2 = SETTING_OF(RADIUS2);
const scalar wind = SETTING_OF(WIND), line_mass = SETTING_OF(LINE_MASS), gravity = SETTING_OF(GRAVITY);
const scalar node_mass = line_mass * mean_edge, per_edge = (scalar)1 / mean_edge;
const scalar* edge = mesh.data;  // rest length of each edge
const scalar tolerance = SETTING_OF(TOLERANCE), step_limit = SETTING_OF(STEP_LIMIT), shortest = SETTING_OF(SHORTEST);
const int max_iterations = (int)SETTING_OF(MAX_ITERATIONS);
const bool first_clamped = SETTING_OF(CLAMPED) > 0, last_clamped = setting.data[SETTING_CLAMPED + 1] > 0;
const scalar node_shift = node_mass * (scalar)2.5e5;  // the inertia of a 2 ms step

auto law = OF_SLING(coefficients, MATERIAL_SIZE);  // of the material
const real mu = law[MATERIAL_MU], lam = law[MATERIAL_LAM], bulk = lam - mu / (scalar)3;
const real damping = law[MATERIAL_DAMPING], shape_damping = law[MATERIAL_SCALE];
const real friction = law[MATERIAL_FRICTION], bending = law[MATERIAL_BENDING];
const real drag = law[MATERIAL_DRAG], turning = law[MATERIAL_TURNING];

// degree of freedom k of section i: in this iterate, predicted, y and xh of step.h, Newton's change of it; then its values
// and rates at the ends of the last step and of the one before
auto initial = OF_SLING(state, DOFS * SECTIONS);
auto stored = OF_SLING(scratch, (9 * DOFS + MEMORIES + 4) * SECTIONS);
#define FIELD(f, k, i) stored[((f) * DOFS + (k)) * SECTIONS + (i)]
#define NOW(k, i) FIELD(0, k, i)
#define PREDICTED(k, i) FIELD(1, k, i)
#define FROM(k, i) FIELD(2, k, i)
#define INERTIAL(k, i) FIELD(3, k, i)
#define CHANGE(k, i) FIELD(4, k, i)
#define LAST(k, i) FIELD(5, k, i)
#define LAST_BUT_ONE(k, i) FIELD(6, k, i)
#define LAST_RATE(k, i) FIELD(7, k, i)
#define RATE_BEFORE(k, i) FIELD(8, k, i)

// what is staged of a section (rod.h): its own block (lower triangle), stretch between nodes, gradient of the twist on both
// sides of the joint, coefficients of bending and twist, residual of this section and of the next
enum { OWN = 0, STRETCH = 45, TWIST = 51, TWIST_NEXT = 57, BEND = 63, TWISTING = 64, FORCE = 65, FORCE_NEXT = 74, NOTHING = 83, STAGED_SIZE = 84 };
// what the elimination stores of a column: multipliers, coupling, solution, 1 / pivot
enum { STORED_COUPLING = DOFS, STORED_SOLUTION = 2 * DOFS, STORED_INVERSE, STORED_SIZE };
#if defined(__CUDA_ARCH__)
const int COLUMN_LENGTH = (DOFS + 3) / 4 * 4;
__shared__ scalar staged[STAGED_SIZE * (SECTIONS | 1)];
// a section's columns of U for the whole chain; two sections in turn
__shared__ __align__(16) scalar shared_columns[4 * (DOFS + 1) * COLUMN_LENGTH];
auto factors = work.data + (size_t)sling * (MIDDLE + 1) * STORED_SIZE * TEAM + first_of_chain;
#define STAGED(v, i) staged[(v) * (SECTIONS | 1) + (i)]
#define STORED(at, row, column) factors[((at) * STORED_SIZE + (row)) * TEAM + (column)]
#define SHARED_COLUMN(columns, at, column, row) \
  shared_columns[(((at & 1) * 2 + backwards) * (DOFS + 1) + (column)) * COLUMN_LENGTH + (row)]
#define SHARE_COLUMNS(columns, at) \
  if (first_column <= DOFS) { UNROLL for (int k = 0; k < DOFS; ++k) SHARED_COLUMN(columns, at, first_column, k) = columns[0][k]; } \
  WAIT_FOR_TEAM
// the back substitution reads a section ahead, so that it need not wait for the memory
const int read_column = first_column < DOFS ? first_column : 0;
#define BEGIN_READING_AHEAD(at) \
  scalar now[STORED_SIZE], ahead[STORED_SIZE]; \
  UNROLL for (int r = 1; r < STORED_SIZE; ++r) ahead[r] = STORED(at, r, read_column)
#define READ_AHEAD(at) \
  UNROLL for (int r = 1; r < STORED_SIZE; ++r) { now[r] = ahead[r]; ahead[r] = STORED(at ? at - 1 : 0, r, read_column); }
#define READ(at, row, column) now[row]
#else
#define BEGIN_READING_AHEAD(at)
#define READ_AHEAD(at)
#define READ(at, row, column) STORED(at, row, column)
auto staged = OF_SLING(work, SECTIONS * (STORED_SIZE * COLUMNS + STAGED_SIZE));
auto factors = staged + SECTIONS * STAGED_SIZE;
#define STAGED(v, i) staged[(i) * STAGED_SIZE + (v)]
#define STORED(at, row, column) factors[((at) * STORED_SIZE + (row)) * COLUMNS + (column)]
#define SHARED_COLUMN(columns, at, column, row) columns[column][row]
#define SHARE_COLUMNS(columns, at)
#endif
#define STAGED_FORCE(m, i) STAGED(FORCE + (m), i)
#define STAGED_FORCE_NEXT(m, i) STAGED(FORCE_NEXT + (m), i)

auto lane = OF_SLING(lanes, LANE_SIZE);
real direction[3], separation[5], payload = lane[LANE_PAYLOAD], outcome = zero;
UNROLL for (int c = 0; c < 3; ++c) direction[c] = lane[LANE_DIRECTION + c];
UNROLL for (int c = 0; c < 5; ++c) separation[c] = zero;

// of the step under way
scalar per_step = 0, per_step2 = 0;                  // 1 / (beta h), its square
bool attached = false, gripped = false;              // the hand leads the middle node; its pads hold the direction as well
bool opening = false;                                // its fingers open
real capacity = zero;                                // what the pads can hold [N]
real bend_share = zero, damp = zero, damp_shape = zero;  // bending, damping / (beta h), that times shape_damping
scalar torsion = 0;
real air = zero;                                     // drag / (beta h)
bool fresh = true;                                   // the Hessian is wanted, not the residual alone
real shift = zero, inexact = zero;                   // of the Hessian: what is added to its diagonal; whether it is not exact
