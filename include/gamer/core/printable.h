#pragma once

#include <string>
#include <string_view>

namespace gamer {

/// `text` for one line of a terminal: line ends and tabs become \n, \r and \t, other control
/// characters (of ASCII and of Unicode, U+0080 to U+009F) and bytes that are not UTF-8 become
/// \xNN. Names of files and what files hold could otherwise move the cursor or begin a line of
/// their own.
std::string printable(std::string_view text);

}  // namespace gamer
