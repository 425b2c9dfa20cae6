/* C interface of Ipminmax, in the shape of Ipopt's IpStdCInterface.h:
 *
 *   IpminmaxProblem problem = IpminmaxCreate(...);
 *   if (!problem) { puts(IpminmaxMessage(NULL)); return 1; }
 *   IpminmaxAddNumOption(problem, "tol", 1e-9);
 *   IpminmaxSolve(problem, x, ...);
 *   IpminmaxGetCertificate(problem, &certificate);
 *   IpminmaxFree(problem);
 *
 * One problem may be used by one thread at a time. Its own callbacks may only call
 * IpminmaxGetCurrentIterate, IpminmaxGetCurrentViolations and IpminmaxGetStatistics. No C++
 * exception leaves these functions. Functions that return int return 1 for success and 0 for
 * failure; IpminmaxMessage then says what is wrong.
 *
 * Structures may grow at their end in later versions. A function that fills one is told its size
 * and writes no more, so a program also works with a later version of the library; see "Sizes of
 * structures" at the end. */
#ifndef IPMINMAX_H
#define IPMINMAX_H

#include <stddef.h>

#if defined(__GNUC__)
#pragma GCC visibility push(default) /* exported by the shared library */
#endif
#ifdef __cplusplus
extern "C" {
#endif

/* Who chooses a variable or owns a constraint. */
enum IpminmaxPlayer { IPMINMAX_MIN = 0, IPMINMAX_MAX = 1 };

enum IpminmaxIndexStyle { IPMINMAX_C_STYLE = 0, IPMINMAX_FORTRAN_STYLE = 1 };

/* Values of Ipopt's ApplicationReturnStatus. */
enum IpminmaxReturnStatus {
  IPMINMAX_SOLVE_SUCCEEDED = 0,
  IPMINMAX_SOLVED_TO_ACCEPTABLE_LEVEL = 1,
  IPMINMAX_INFEASIBLE_PROBLEM_DETECTED = 2,
  IPMINMAX_SEARCH_DIRECTION_BECOMES_TOO_SMALL = 3,
  IPMINMAX_DIVERGING_ITERATES = 4,
  IPMINMAX_USER_REQUESTED_STOP = 5,
  IPMINMAX_FEASIBLE_POINT_FOUND = 6,
  IPMINMAX_MAXIMUM_ITERATIONS_EXCEEDED = -1,
  IPMINMAX_RESTORATION_FAILED = -2,
  IPMINMAX_ERROR_IN_STEP_COMPUTATION = -3,
  IPMINMAX_MAXIMUM_CPUTIME_EXCEEDED = -4,
  IPMINMAX_MAXIMUM_WALLTIME_EXCEEDED = -5, /* with Ipopt 3.14; with 3.11 -4 stands in */
  IPMINMAX_NOT_ENOUGH_DEGREES_OF_FREEDOM = -10,
  IPMINMAX_INVALID_PROBLEM_DEFINITION = -11,
  IPMINMAX_INVALID_OPTION = -12,
  IPMINMAX_INVALID_NUMBER_DETECTED = -13,
  IPMINMAX_UNRECOVERABLE_EXCEPTION = -100,
  IPMINMAX_NONIPOPT_EXCEPTION_THROWN = -101,
  IPMINMAX_INSUFFICIENT_MEMORY = -102,
  IPMINMAX_INTERNAL_ERROR = -199
};

enum IpminmaxPointKind {
  IPMINMAX_LOCAL_MINMAX = 0,      /* certified: both inertias as expected, with a margin */
  IPMINMAX_FIRST_ORDER_POINT = 1, /* stationary, not certified */
  IPMINMAX_FEASIBLE_POINT = 2,
  IPMINMAX_INFEASIBLE_POINT = 3,
  IPMINMAX_UNKNOWN_POINT = 4 /* no point, or one at which the constraints are undefined */
};

enum IpminmaxSecondOrder {
  IPMINMAX_NOT_TESTED = 0, /* not a first-order point, or minmax_certificate none */
  IPMINMAX_SATISFIED = 1,
  IPMINMAX_UNDECIDED = 2, /* neither certified nor refuted; see reasons */
  IPMINMAX_VIOLATED = 3,  /* refuted: a player gains along some direction */
  IPMINMAX_FLAT = 4 /* not refuted, the value is constant along directions without curvature */
};

/* What is known of y, Max's answer to x; unknown if the point is not certified. */
enum IpminmaxAnswer {
  IPMINMAX_ANSWER_UNKNOWN = 0,
  IPMINMAX_ANSWER_STRICTLY_BEST = 1,  /* not given any more */
  IPMINMAX_ANSWER_UNIQUE = 2,         /* exactly one answer to each x nearby, Lipschitz in x */
  IPMINMAX_ANSWER_SMOOTH = 3,         /* the same, and differentiable in x */
  IPMINMAX_ANSWER_BEST_NOT_UNIQUE = 4 /* no y nearby is better at this x, others may be as good */
};

typedef struct IpminmaxInertia {
  int positive, negative, zero; /* numbers of eigenvalues */
} IpminmaxInertia;

/* Result of the second-order test at the returned point; see docs/certificate.md. */
typedef struct IpminmaxCertificate {
  enum IpminmaxPointKind point_kind;
  enum IpminmaxSecondOrder second_order;
  IpminmaxInertia inner, inner_expected; /* of the maximizer's KKT matrix */
  IpminmaxInertia full, full_expected;   /* of both players' */
  double margin;          /* curvature that the test subtracted, scaled; 0 unless satisfied */
  int licq_min, licq_max; /* 1: gradients of the player's active constraints are independent */
  int weakly_active_min, weakly_active_max; /* numbers of active bounds with multiplier zero */
  int finite_differences; /* 1: second derivatives are differences of first ones */
  /* Estimate of the error of these differences, in curvature; the result allows for it. 0 if second
   * derivatives are the model's. Infinite: the differences cannot be trusted. */
  double hessian_error;
  enum IpminmaxAnswer answer;
  /* Why the point is not certified, or remarks: a line for each, with names of variables and
   * constraints; "" without any. Valid until the next call with this problem. */
  const char *reasons;
  /* 1: second derivatives disagree with differences of the gradients; nothing is certified. */
  int hessian_disagrees;
  double least_curvature;       /* estimate, scaled, at most 1; 0 unless satisfied */
  int least_curvature_variable; /* index, from 0, of the variable that moves most along the
                                   direction of least curvature; -1: not known */
} IpminmaxCertificate;

typedef struct IpminmaxStatistics {
  int iterations;
  int factorizations;
  int analyses; /* orderings and symbolic factorizations; 0: those of an earlier solve were used */
  int objective_evaluations, gradient_evaluations, constraint_evaluations, jacobian_evaluations,
      hessian_evaluations;
  double seconds; /* wall time */
  double cpu_seconds;
  /* Errors of the first-order conditions, infinity norms, unscaled; error is Ipopt's scaled E_0. */
  double primal_error, dual_error_min, dual_error_max, complementarity_error;
  double error;
  /* Factor of the objective inside the solve. Negative: Min maximized and Max minimized, and the
   * multipliers of their bounds have the opposite signs. */
  double objective_scale;
} IpminmaxStatistics;

/* The model's functions, with Ipopt's arguments. They return 1 for success, 0 if the function is
 * undefined at x. Only the low byte of the returned value is read, so callbacks made for Ipopt
 * 3.14, which return bool, may be cast to these types. They must not write to x and lambda. A call
 * with values == NULL asks for the structure of a matrix, a call with iRow == jCol == NULL for its
 * values. The Hessian is that of obj_factor f + lambda' g: one of the entries (i,j) and (j,i);
 * duplicates add. Pass NULL for eval_h if the model has no second derivatives. */
typedef int (*IpminmaxEval_F_CB)(int n, double *x, int new_x, double *obj_value, void *user_data);
typedef int (*IpminmaxEval_Grad_F_CB)(int n, double *x, int new_x, double *grad_f, void *user_data);
typedef int (*IpminmaxEval_G_CB)(int n, double *x, int new_x, int m, double *g, void *user_data);
typedef int (*IpminmaxEval_Jac_G_CB)(int n, double *x, int new_x, int m, int nele_jac, int *iRow,
                                     int *jCol, double *values, void *user_data);
typedef int (*IpminmaxEval_H_CB)(int n, double *x, int new_x, double obj_factor, int m,
                                 double *lambda, int new_lambda, int nele_hess, int *iRow,
                                 int *jCol, double *values, void *user_data);
/* Evaluates only `count` rows (0-based, ascending): writes their values into g (m entries) or, if g
 * is NULL, their entries of the Jacobian into values (nele_jac entries). Other entries may stay as
 * they are. */
typedef int (*IpminmaxEval_Rows_CB)(int n, double *x, int new_x, int count, const int *rows, int m,
                                    double *g, int nele_jac, double *values, void *user_data);
/* Is called at the starting point and after each iteration; returning 0 stops the solve at that
 * point. alg_mod is 0 in ordinary iterations; 1 in those of a feasibility restoration, in which
 * iter_count does not change; 2 in those of a maximization over y at fixed x. In the last case
 * obj_value is the value reached, the numbers after it are 0, there is no current iterate, and a
 * stop returns the best finished point. */
typedef int (*IpminmaxIntermediate_CB)(int alg_mod, int iter_count, double obj_value, double inf_pr,
                                       double inf_du, double mu, double d_norm,
                                       double regularization_size, double alpha_du, double alpha_pr,
                                       int ls_trials, void *user_data);

typedef struct IpminmaxProblemInfo *IpminmaxProblem;

/* Creates a problem with n >= 0 variables with bounds x_L, x_U (n entries) and m >= 0 constraints
 * with bounds g_L, g_U (m entries). Bounds outside (nlp_lower_bound_inf, nlp_upper_bound_inf), by
 * default +-1e19, are absent. nele_jac, nele_hess: numbers of entries of Jacobian and Hessian.
 * eval_g and eval_jac_g may be NULL if m is 0. eval_h may be NULL: second derivatives are then
 * differences of first ones. variable_players: n values of IpminmaxPlayer; all IPMINMAX_MIN is a
 * minimization. constraint_players: m values, or NULL: a constraint with a Jacobian entry in a Max
 * variable is Max's, any other is Min's. Arrays are copied. Returns NULL on failure;
 * IpminmaxMessage(NULL) says why. */
IpminmaxProblem IpminmaxCreate(int n, const double *x_L, const double *x_U, int m,
                               const double *g_L, const double *g_U, int nele_jac, int nele_hess,
                               int index_style, IpminmaxEval_F_CB eval_f, IpminmaxEval_G_CB eval_g,
                               IpminmaxEval_Grad_F_CB eval_grad_f, IpminmaxEval_Jac_G_CB eval_jac_g,
                               IpminmaxEval_H_CB eval_h, const int *variable_players,
                               const int *constraint_players);

/* Frees a problem; NULL is allowed. Inside a callback of the problem nothing is freed, and
 * IpminmaxMessage says so. */
void IpminmaxFree(IpminmaxProblem problem);

/* Set an option by name for the next solves. Return 0 if the option is unknown or the value
 * invalid. Each solve also reads the file ipminmax.opt. */
int IpminmaxAddStrOption(IpminmaxProblem problem, const char *keyword, const char *val);
int IpminmaxAddNumOption(IpminmaxProblem problem, const char *keyword, double val);
int IpminmaxAddIntOption(IpminmaxProblem problem, const char *keyword, int val);

/* Writes the log also to a file, with print_level 0 to 12. */
int IpminmaxOpenOutputFile(IpminmaxProblem problem, const char *file_name, int print_level);

/* Sets the scaling factors that nlp_scaling_method user-scaling uses: x_scaling (n entries) and
 * g_scaling (m entries), or NULL for none. They must be in [1e-20, 1e20]. With a negative
 * obj_scaling Min maximizes and Max minimizes. */
int IpminmaxSetScaling(IpminmaxProblem problem, double obj_scaling, const double *x_scaling,
                       const double *g_scaling);

/* Sets bounds for the next solves: x_L, x_U (n entries), g_L, g_U (m entries); NULL leaves them as
 * they are. IpminmaxSolveAgain needs no analysis if the kinds of bounds (absent, one-sided, equal)
 * stay the same. */
int IpminmaxSetBounds(IpminmaxProblem problem, const double *x_L, const double *x_U,
                      const double *g_L, const double *g_U);

/* Sets the callback that evaluates single rows, so that a robust constraint can be maximized
 * without evaluating the others; eval_h should skip rows with lambda 0. NULL: eval_g and eval_jac_g
 * evaluate all rows. */
int IpminmaxSetRowsCallback(IpminmaxProblem problem, IpminmaxEval_Rows_CB eval_rows);

/* Sets the intermediate callback; NULL removes it. */
int IpminmaxSetIntermediateCallback(IpminmaxProblem problem,
                                    IpminmaxIntermediate_CB intermediate_cb);

/* Solves the problem. x (n entries) is the starting point on entry and the last point on return.
 * Outputs, each may be NULL: g (m), obj_val, mult_g (m), mult_x_L (n), mult_x_U (n). With
 * warm_start_init_point yes the multipliers are also inputs and must not be NULL. They satisfy
 * grad f + J' mult_g - mult_x_L + mult_x_U = 0, so multipliers of a Max variable's bounds are <= 0.
 * Nothing is written if the solve is refused (invalid option, invalid problem, too few degrees of
 * freedom). If it ends because a function is undefined at the start, all outputs but x are NaN. */
enum IpminmaxReturnStatus IpminmaxSolve(IpminmaxProblem problem, double *x, double *g,
                                        double *obj_val, double *mult_g, double *mult_x_L,
                                        double *mult_x_U, void *user_data);

/* Solves as IpminmaxSolve, with the starts (option minmax_starts) on all MPI ranks. Each rank must
 * call this with the same problem and options. Outputs are the same on all ranks; only rank 0
 * prints. Another thread than this one calls the callbacks. Returns IPMINMAX_INVALID_OPTION if MPI
 * cannot be used; IpminmaxMessage says why. */
enum IpminmaxReturnStatus IpminmaxSolveOverRanks(IpminmaxProblem problem, double *x, double *g,
                                                 double *obj_val, double *mult_g, double *mult_x_L,
                                                 double *mult_x_U, void *user_data);

/* Solves a problem of the same structure again, warm started (as with warm_start_init_point yes)
 * from x and the multipliers of the last solve. user_data and IpminmaxSetBounds may have changed
 * the numbers. Orderings, symbolic factorizations, scaling and the last shifts of the Hessian are
 * kept (IpminmaxStatistics.analyses is 0); with robust constraints, their worst cases are kept
 * instead. Arguments as in IpminmaxSolve, except that multipliers are only outputs. Returns IPMINMAX_INVALID_PROBLEM_DEFINITION if there is no last point. */
enum IpminmaxReturnStatus IpminmaxSolveAgain(IpminmaxProblem problem, double *x, double *g,
                                             double *obj_val, double *mult_g, double *mult_x_L,
                                             double *mult_x_U, void *user_data);

/* Write the certificate and the statistics of the last solve. They return 0 if there was none or it
 * was refused. Inside the intermediate callback IpminmaxGetStatistics gives those of the current
 * solve. */
int IpminmaxGetCertificate(IpminmaxProblem problem, IpminmaxCertificate *certificate);
int IpminmaxGetCertificateSized(IpminmaxProblem problem, IpminmaxCertificate *certificate,
                                size_t size);
int IpminmaxGetStatistics(IpminmaxProblem problem, IpminmaxStatistics *statistics);
int IpminmaxGetStatisticsSized(IpminmaxProblem problem, IpminmaxStatistics *statistics,
                               size_t size);

/* What a search for the worst case over y at fixed x has found; see docs/certificate.md. */
typedef struct IpminmaxWorstCase {
  int starts;         /* number of maximizations; 0: no search (see higher) */
  int maxima;         /* number of distinct certified maxima over y */
  int competing;      /* number of distinct maxima with the largest value; with 2 or more max over y
                         of f may have a kink (no derivative) at this x */
  double value;       /* largest f(x, y) found at a feasible y: a lower bound of the worst case */
  int found;          /* 1: there is such a y */
  int higher;         /* 1: value exceeds f at the point asked about by more than the accuracy of a
                         maximization, or unbounded is 1. If starts is 0, value is the largest f at
                         this x with the y of another start of a multistart (minmax_starts) */
  int unbounded;      /* 1: a maximization over y diverged */
  int single_branch;  /* 1: all ended at one maximum: f looks concave in y here */
  int stated_concave; /* 1: option minmax_concave_in_y is set */
} IpminmaxWorstCase;

/* Searches for the worst case over all of y at the Min variables of x (n entries), from `starts`
 * starting points of y (at least 1), the first of them that of x. Uses the options of the next
 * solve. worst_x (n entries, or NULL) receives x with the worst y. Returns 0 if it cannot be done;
 * IpminmaxMessage says why. */
int IpminmaxCheckWorstCase(IpminmaxProblem problem, const double *x, int starts,
                           IpminmaxWorstCase *worst_case, double *worst_x, void *user_data);
int IpminmaxCheckWorstCaseSized(IpminmaxProblem problem, const double *x, int starts,
                                IpminmaxWorstCase *worst_case, size_t size, double *worst_x,
                                void *user_data);
/* Writes the same for the last solve; starts is 0 if that did not search (option
 * minmax_worst_case_starts). Returns 0 if there was no solve or it was refused. */
int IpminmaxGetWorstCase(IpminmaxProblem problem, IpminmaxWorstCase *worst_case, double *worst_x);
int IpminmaxGetWorstCaseSized(IpminmaxProblem problem, IpminmaxWorstCase *worst_case, size_t size,
                              double *worst_x);
/* Writes the values of f at the distinct maxima over y that the last of these calls found, the
 * largest first, at most `capacity` of them. Returns how many are known (at most 10). values may be
 * NULL if capacity is 0. */
int IpminmaxGetWorstCaseBranches(IpminmaxProblem problem, int capacity, double *values);

/* Computes the duality gap most - least at x (n entries) by two solves. It uses the options of the
 * next IpminmaxSolve. The game must be convex in the Min variables and concave in the Max variables, with linear
 * constraints of each player's own. most is the largest objective over the Max variables, least the
 * smallest over the Min variables, with the other player's variables held at x. saddle_point is 1
 * if they differ by at most the smaller of the option tol and R / 1000, or by at most 1e-6 R. R is
 * the range of f over some points. x is then a saddle point over all variables. Each output may be
 * NULL. Returns 0 if the conditions do not hold or a solve fails; IpminmaxMessage says why. */
int IpminmaxFindGap(IpminmaxProblem problem, const double *x, double *most, double *least,
                    int *saddle_point, void *user_data);

/* Writes the worst cases of the last solve's robust constraints (Min's that read Max variables),
 * and of f with option minmax_epigraph; see docs/robust_constraints.md. Returns how many there are,
 * and fills the first `capacity` entries of each array that is not NULL: constraints (indices from
 * 0, m for f), values (of the constraint there), multipliers, active (1: this worst case limits x),
 * worst_x (capacity times n: x and that y). Returns 0 if there are none or no solve has ended. */
int IpminmaxGetRobustWorstCases(IpminmaxProblem problem, int capacity, int *constraints,
                                double *values, double *multipliers, int *active, double *worst_x);

/* Writes the certified points that the starts of the last solve (option minmax_starts) led to, the
 * best first. Returns how many there are, and fills the first `capacity` entries of each array that
 * is not NULL: values (of the objective), found (number of starts that ended there), x (capacity
 * times n). */
int IpminmaxGetPoints(IpminmaxProblem problem, int capacity, double *values, int *found, double *x);

/* Returns the last solve in words: 0 why it stopped (the first line says what happened, further
 * lines why and what to do), 1 what the point is locally, 2 what was searched over all of y, 3 what
 * was searched over x; "" before the first solve and for other numbers. Valid until the next call
 * for this problem. */
const char *IpminmaxStatement(IpminmaxProblem problem, int which);

/* Writes the iterate as IpminmaxSolve would return it if the callback stopped now, unscaled. Works
 * only inside the intermediate callback and returns 0 elsewhere. x, z_L and z_U have n entries, g
 * and lambda m; each may be NULL. Calls eval_f and eval_g, with fixed variables also eval_grad_f
 * and eval_jac_g. */
int IpminmaxGetCurrentIterate(IpminmaxProblem problem, int n, double *x, double *z_L, double *z_U,
                              int m, double *g, double *lambda);

/* Writes by how much the iterate violates the first-order conditions, unscaled, 0 if there is no
 * bound. Works only inside the intermediate callback and returns 0 elsewhere, or if a derivative is
 * undefined. Each output may be NULL. Calls eval_grad_f and eval_jac_g.
 *   x_L_violation, x_U_violation (n)  max(x_L - x, 0), max(x - x_U, 0)
 *   compl_x_L, compl_x_U (n)          (x - x_L) z_L, (x_U - x) z_U; 0 for a fixed variable
 *   grad_lag_x (n)                    grad f + J' lambda - z_L + z_U
 *   nlp_constraint_violation (m)      max(g_L - g, g - g_U, 0)
 *   compl_g (m)                       (g_U - g) lambda where lambda presses against g_U (positive
 *                                     for a constraint of Min, negative for Max), else
 *                                     (g_L - g) lambda; (c - g) lambda for an equation g = c */
int IpminmaxGetCurrentViolations(IpminmaxProblem problem, int n, double *x_L_violation,
                                 double *x_U_violation, double *compl_x_L, double *compl_x_U,
                                 double *grad_lag_x, int m, double *nlp_constraint_violation,
                                 double *compl_g);

/* --- Sensitivity: derivatives of the last solution, and predictions if constants of the model
 * change
 *
 * The parameters of a model are its bounds: right-hand sides of equations and values of fixed
 * variables (equal bounds, to be moved by the same amount), bounds of variables and
 * inequalities. */

/* Prepares the functions below for the last solution. Call it before IpminmaxSetBounds. It takes
 * one evaluation of the derivatives and one factorization. The callbacks get the user_data of the
 * last call that had one; what it points to must be as in the last solve. Returns 0 if the solution
 * has no derivatives; IpminmaxMessage says why. */
int IpminmaxUpdateSensitivity(IpminmaxProblem problem);

/* Writes the derivative of the solution along a change of bounds dx_L, dx_U (n entries), dg_L, dg_U
 * (m entries); NULL means unchanged. Outputs, each may be NULL, signs as in IpminmaxSolve: dx (n),
 * dmult_g (m), dmult_x_L, dmult_x_U (n), dobj and d2obj: first and second derivative of the
 * value. */
int IpminmaxGetDerivative(IpminmaxProblem problem, const double *dx_L, const double *dx_U,
                          const double *dg_L, const double *dg_U, double *dx, double *dmult_g,
                          double *dmult_x_L, double *dmult_x_U, double *dobj, double *d2obj);

/* Writes the derivative of the maximizer's answer if Min's variables move along dx_min (n entries,
 * Max's are not read). Outputs as before; dobj is the derivative of the maximum over y. */
int IpminmaxGetReaction(IpminmaxProblem problem, const double *dx_min, double *dx, double *dmult_g,
                        double *dmult_x_L, double *dmult_x_U, double *dobj, double *d2obj);

/* Predicts the solution after a finite change of bounds (arrays as in IpminmaxGetDerivative). The
 * prediction follows the linearized equations through changes of the active set. Outputs, each may
 * be NULL: x (n), mult_g (m), mult_x_L, mult_x_U (n), obj (to second order), share: the part of the
 * change, 0 to 1, that could be followed; below 1 IpminmaxMessage says why. */
int IpminmaxPredict(IpminmaxProblem problem, const double *dx_L, const double *dx_U,
                    const double *dg_L, const double *dg_U, double *x, double *mult_g,
                    double *mult_x_L, double *mult_x_U, double *obj, double *share);
/* Predicts the maximizer's answer if Min's variables move by dx_min (n entries). */
int IpminmaxPredictReaction(IpminmaxProblem problem, const double *dx_min, double *x,
                            double *mult_g, double *mult_x_L, double *mult_x_U, double *obj,
                            double *share);

/* A bound that begins to be active (enters is 1) or ceases to be (0) once `share` of the predicted
 * change of bounds is made; share is between 0 and 1. */
typedef struct IpminmaxActiveSetChange {
  double share;
  int of_constraint; /* 1: a bound of constraint `index`, 0: of variable `index` */
  int index;         /* from 0 */
  int upper;         /* 1: the upper bound */
  int enters;
} IpminmaxActiveSetChange;

/* Writes the active-set changes of the last prediction in their order, at most `capacity` of them.
 * Returns how many there are. changes may be NULL if capacity is 0. */
int IpminmaxGetActiveSetChanges(IpminmaxProblem problem, int capacity,
                                IpminmaxActiveSetChange *changes);
int IpminmaxGetActiveSetChangesSized(IpminmaxProblem problem, int capacity,
                                     IpminmaxActiveSetChange *changes, size_t size);

/* Returns the name of the status of the last solve (docs/statuses.md), which tells more cases apart
 * than the return status; "" before the first solve. */
const char *IpminmaxStatusName(IpminmaxProblem problem);

/* Returns the message of the last failed call on the problem, or of its last solve; for NULL that
 * of this thread's last call that failed without a problem. Valid until the next call. */
const char *IpminmaxMessage(IpminmaxProblem problem);

/* Returns the version of the library, "major.minor.patch". */
const char *IpminmaxVersion(void);

/* --- Sizes of structures
 *
 * The symbols without Sized fill structures as the first version of this header had them, for
 * programs compiled against that version. In a source file the macros below turn these names into
 * the functions with Sized and pass the size that this header knows (for the last one, of an array
 * element). Languages that call the library by its symbols should call the functions with Sized. */
#define IpminmaxGetCertificate(problem, certificate) \
  IpminmaxGetCertificateSized(problem, certificate, sizeof(IpminmaxCertificate))
#define IpminmaxGetStatistics(problem, statistics) \
  IpminmaxGetStatisticsSized(problem, statistics, sizeof(IpminmaxStatistics))
#define IpminmaxCheckWorstCase(problem, x, starts, worst_case, worst_x, user_data)                \
  IpminmaxCheckWorstCaseSized(problem, x, starts, worst_case, sizeof(IpminmaxWorstCase), worst_x, \
                              user_data)
#define IpminmaxGetWorstCase(problem, worst_case, worst_x) \
  IpminmaxGetWorstCaseSized(problem, worst_case, sizeof(IpminmaxWorstCase), worst_x)
#define IpminmaxGetActiveSetChanges(problem, capacity, changes) \
  IpminmaxGetActiveSetChangesSized(problem, capacity, changes, sizeof(IpminmaxActiveSetChange))

#ifdef __cplusplus
}
#endif
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif /* IPMINMAX_H */
