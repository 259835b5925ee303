"""Result of a battery of checks, as of a model or a task."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Findings:
    """Problems and remarks from a battery of checks."""

    name: str  # of what was checked
    # faults that make it unusable, each with a remedy or its place
    problems: tuple[str, ...]
    remarks: tuple[str, ...] = ()  # unusual facts, which may be right

    @property
    def ok(self) -> bool:
        """True where there are no problems."""
        return not self.problems

    @property
    def verdict(self) -> str:
        """Soundness in words."""
        return "sound" if self.ok else f"{len(self.problems)} problem(s)"

    def __str__(self) -> str:
        """Verdict, then a line for each problem and remark."""
        lines = [f"{self.name}: {self.verdict}"]
        lines += [f"  problem: {problem}" for problem in self.problems]
        lines += [f"  remark: {remark}" for remark in self.remarks]
        return "\n".join(lines)
