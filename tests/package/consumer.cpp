// A user's program built against the installed package; exits nonzero when the answer is wrong.
#include <cmath>
#include <cstdio>

#include <ipminmax/adapter/minmax_application.hpp>

#include "model.hpp"

int main() {
  Ipopt::SmartPtr<Model> model = new Model;
  Ipopt::SmartPtr<Ipopt::TNLP> game = new ipminmax::SplitTNLP(GetRawPtr(model), {1});

  Ipopt::SmartPtr<ipminmax::MinMaxApplication> app = new ipminmax::MinMaxApplication(false);
  app->Options()->SetNumericValue("tol", 1e-9);
  if (app->Initialize("") != Ipopt::Solve_Succeeded) return 1;
  const Ipopt::ApplicationReturnStatus status = app->OptimizeTNLP(game);

  const ipminmax::Result& result = app->LastResult();
  const ipminmax::Certificate& certificate = result.certificate;
  std::printf("x = %.6f, y = %.6f, lambda = %.6f, f = %.6f, status %d: %s\n", model->x, model->y,
              model->multiplier, model->objective, static_cast<int>(status),
              result.message.c_str());

  const auto near = [](double a, double b) { return std::abs(a - b) < 1e-6; };
  const bool right =
      status == Ipopt::Solve_Succeeded && certificate.kind == ipminmax::PointKind::LocalMinmax &&
      certificate.inner == certificate.inner_expected &&
      certificate.full == certificate.full_expected && near(model->x, 3.0) && near(model->y, 3.0) &&
      near(model->multiplier, 6.0) && near(model->objective, -18.0) && near(result.v[0], 3.0);
  std::puts(right ? "certified local minmax" : "WRONG ANSWER");
  return right ? 0 : 1;
}
