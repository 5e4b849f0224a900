#pragma once
// The text of an error, for tests that know it to the letter.

#include <string>

#include "core/check.h"

namespace rugae {

/// The text of the Error that `call` throws; "no error" when it throws none.
std::string message_of(const auto& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace rugae
