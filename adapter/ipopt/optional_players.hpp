#pragma once

namespace ipminmax {

/// Base of adapters whose models may have one player only, without anything having been forgotten.
class OptionalPlayers {
 public:
  /// Whether the model itself gives constraints to Max: not by mistake then.
  [[nodiscard]] virtual bool gives_constraints_to_max() const { return false; }

 protected:
  OptionalPlayers() = default;
  virtual ~OptionalPlayers() = default;
};

}  // namespace ipminmax
