// What a user can do something about: what it is about, why it fails, what to do.
#pragma once

#include <stdexcept>
#include <string>

namespace derain {

class InputError : public std::runtime_error {
 public:
  InputError(const std::string& subject, const std::string& reason, const std::string& remedy)
      : std::runtime_error(subject + ": " + reason + ". " + remedy) {}
};

}  // namespace derain
