// SPDX-License-Identifier: Apache-2.0
/// @file
/// Comma-separated tables in and out, with errors that name file, line and column.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::io {

/// A table with a header line. Lines starting with '#' and empty lines are skipped; spaces and a carriage
/// return around cells are dropped; every row has as many cells as the header, or fewer if the last ones
/// are left out.
struct CsvTable {
  std::string file;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::vector<int> lines;  ///< line number of each row in the file, from 1

  /// Column of a name; Error naming the file and the columns found if it is absent.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  [[nodiscard]] bool has_column(std::string_view name) const;
  /// Finite number in a cell; Error with file, line and column otherwise.
  [[nodiscard]] double number(std::size_t row, std::size_t column) const;
  /// "file:line" of a row.
  [[nodiscard]] std::string where(std::size_t row) const;
};

/// Reads a table; Error if the file cannot be read, is empty, or a row has more cells than the header.
[[nodiscard]] CsvTable read_csv(const std::filesystem::path& file);

/// A finite number from all of `text`, or false.
[[nodiscard]] bool parse_number(std::string_view text, double& value);

/// Header and rows as text; all rows as long as the header.
[[nodiscard]] std::string format_csv(const std::vector<std::string>& header,
                                     const std::vector<std::vector<double>>& rows);

}  // namespace trammel::io
