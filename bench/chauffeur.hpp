#pragma once

#include <stdexcept>

#include <examples/chauffeur_tnlp.hpp>

#include "adapter/ipopt/minmax_application.hpp"

namespace bench {

/// Where every stage's controls start.
inline constexpr chauffeur::Control kGuess{0.01, 0.002, 0.001};

/// Prints nothing and stops a solve after so many factorizations (0: no limit) or iterations.
inline Ipopt::SmartPtr<ipminmax::MinMaxApplication> quiet_application(double tol, int iterations,
                                                                      int factorizations = 0) {
  Ipopt::SmartPtr<ipminmax::MinMaxApplication> application = new ipminmax::MinMaxApplication(false);
  const auto options = application->Options();
  options->SetIntegerValue("print_level", 0);
  options->SetStringValue("sb", "yes");
  options->SetNumericValue("tol", tol);
  options->SetIntegerValue("max_iter", iterations);
  options->SetIntegerValue("minmax_max_factorizations", factorizations);
  if (application->Initialize("") != Ipopt::Solve_Succeeded) {
    throw std::runtime_error("the application refuses its options");
  }
  return application;
}

}  // namespace bench
