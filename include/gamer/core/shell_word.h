#pragma once

#include <string>

namespace gamer {

/// The word as a shell reads it, in characters that print. Control characters and bytes that are
/// not ASCII become octal numbers in $'...', which bash, ksh and zsh know.
std::string shell_word(const std::string& word);

}  // namespace gamer
