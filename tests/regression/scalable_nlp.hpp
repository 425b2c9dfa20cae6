#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax::testing {

/// A family of minimizations that exists in any size.
struct ScalableNlp {
  std::string name;
  std::function<std::unique_ptr<Problem>(Index)> make;  ///< about how many variables, from 100
};

/// Families whose evaluations take time proportional to the number of variables, meant for 100 to
/// 100000 of them: chained problems of Luksan and Vlcek (Sparse and Partially Separable Test
/// Problems, 1999), control of elliptic equations as in Maurer and Mittelmann (2000, 2001), and
/// others. Made once.
[[nodiscard]] const std::vector<ScalableNlp>& scalable_nlps();

/// Throws std::out_of_range when there is none.
[[nodiscard]] const ScalableNlp& scalable_nlp(const std::string& name);

}  // namespace ipminmax::testing
