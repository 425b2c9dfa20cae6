#pragma once

#include <utility>

#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Arrays taken over from where they are kept, so that their memory serves again, and given back at
/// the end. What they hold on the way in means nothing.
template <class Arrays>
class Kept : public Arrays, public Uncopied {
 public:
 protected:
  /// owner: null for none.
  explicit Kept(Arrays* owner)
      : Arrays(owner != nullptr ? std::move(*owner) : Arrays()), owner_(owner) {}
  ~Kept() {
    if (owner_ != nullptr) *owner_ = std::move(static_cast<Arrays&>(*this));
  }

 private:
  Arrays* owner_;
};

}  // namespace ipminmax
