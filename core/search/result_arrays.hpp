#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"

namespace ipminmax {

/// Room for the arrays of a Result, kept from one to the next.
struct ResultArrays {
  std::vector<double> v, lambda, z_lower, z_upper, constraints;
  std::string message;

  /// The room of a result that is not needed any more.
  void take_from(Result& result) {
    exchange(result);
    result = {};
  }
  /// To a result without arrays, whose arrays then hold values of no meaning.
  void give_to(Result& result) {
    exchange(result);
    result.message.clear();
  }

 private:
  void exchange(Result& result) {
    v.swap(result.v);
    lambda.swap(result.lambda);
    z_lower.swap(result.z_lower);
    z_upper.swap(result.z_upper);
    constraints.swap(result.constraints);
    message.swap(result.message);
  }
};

}  // namespace ipminmax
