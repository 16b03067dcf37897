// The one error a user's input can cause.
#pragma once

#include <stdexcept>

namespace lobefit {

// Input that cannot be used. The message is one sentence that names the file, what was expected
// and what was found, fit to be shown to a user as it is.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace lobefit
