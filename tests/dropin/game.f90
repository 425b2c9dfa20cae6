! A game through Ipopt's Fortran interface, linked with libipopt: which library solves it is decided
! when it is loaded. An option says that the second variable is the maximizer's.
!
!   min over x, max over y of x^2 + 2 x + x y - y^2,   x + y <= 10:   x = -0.8, y = -0.4
!
! With Ipopt itself the option does not exist and the program ends with an error.
program game
  implicit none
  integer, parameter :: n = 2, m = 1
  double precision :: x(n), x_l(n), x_u(n), g(m), g_l(m), g_u(m), lambda(m), z_l(n), z_u(n)
  double precision :: f, reals(1)
  integer :: integers(1), status
  integer(8) :: problem
  integer(8), external :: ipcreate
  integer, external :: ipsolve, ipaddstroption, ipaddnumoption, ipaddintoption
  external :: eval_f, eval_g, eval_grad, eval_jac, eval_hess, ipfree

  x_l = -1d20
  x_u = 1d20
  g_l = -1d20
  g_u = 10d0
  x = 1d0
  problem = ipcreate(n, x_l, x_u, m, g_l, g_u, 2, 3, 1, eval_f, eval_g, eval_grad, eval_jac, &
                     eval_hess)
  if (problem == 0) stop 1
  if (ipaddstroption(problem, 'minmax_max_variables', '1') /= 0) stop 2
  if (ipaddnumoption(problem, 'tol', 1d-9) /= 0) stop 3
  if (ipaddintoption(problem, 'print_level', 0) /= 0) stop 4
  status = ipsolve(problem, x, g, f, lambda, z_l, z_u, integers, reals)
  print '(a, i0, a, f7.4, a, f7.4, a, f7.4)', 'status ', status, ', x =', x(1), ', y =', x(2), &
    ', f =', f
  call ipfree(problem)
  if (status /= 0 .or. abs(x(1) + 0.8d0) > 1d-6 .or. abs(x(2) + 0.4d0) > 1d-6) stop 5
end program game

subroutine eval_f(n, x, new_x, f, integers, reals, error)
  implicit none
  integer :: n, new_x, integers(*), error
  double precision :: x(n), f, reals(*)
  f = x(1)**2 + 2d0 * x(1) + x(1) * x(2) - x(2)**2
  error = 0
end subroutine eval_f

subroutine eval_grad(n, x, new_x, grad, integers, reals, error)
  implicit none
  integer :: n, new_x, integers(*), error
  double precision :: x(n), grad(n), reals(*)
  grad(1) = 2d0 * x(1) + 2d0 + x(2)
  grad(2) = x(1) - 2d0 * x(2)
  error = 0
end subroutine eval_grad

subroutine eval_g(n, x, new_x, m, g, integers, reals, error)
  implicit none
  integer :: n, new_x, m, integers(*), error
  double precision :: x(n), g(m), reals(*)
  g(1) = x(1) + x(2)
  error = 0
end subroutine eval_g

subroutine eval_jac(task, n, x, new_x, m, entries, rows, columns, values, integers, reals, error)
  implicit none
  integer :: task, n, new_x, m, entries, rows(entries), columns(entries), integers(*), error
  double precision :: x(n), values(entries), reals(*)
  if (task == 0) then
    rows = 1
    columns = [1, 2]
  else
    values = 1d0
  end if
  error = 0
end subroutine eval_jac

subroutine eval_hess(task, n, x, new_x, factor, m, lambda, new_lambda, entries, rows, columns, &
                     values, integers, reals, error)
  implicit none
  integer :: task, n, new_x, m, new_lambda, entries, rows(entries), columns(entries)
  integer :: integers(*), error
  double precision :: x(n), factor, lambda(m), values(entries), reals(*)
  if (task == 0) then
    rows = [1, 2, 2]
    columns = [1, 1, 2]
  else
    values = factor * [2d0, 1d0, -2d0]
  end if
  error = 0
end subroutine eval_hess
