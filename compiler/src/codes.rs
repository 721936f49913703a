//! The codes of all diagnostics. `docs/diagnostics.md` explains each of them, and a test checks
//! that none is missing there.

/// The severity of a diagnostic: an error stops the build, a warning does not. A [`DiagnosticCode`] has
/// exactly one severity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The script is valid, but may not do what its author intends.
    Warning,
    /// The compiler produces no image.
    Error,
}

macro_rules! codes {
    ($($variant:ident = $text:literal, $title:literal;)*) => {
        /// A kind of error (`E....`) or warning (`W....`). The number never changes its meaning.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum DiagnosticCode { $(#[doc = $title] $variant,)* }

        impl DiagnosticCode {
            /// Every code, in order.
            pub const ALL: &'static [DiagnosticCode] = &[$(DiagnosticCode::$variant,)*];

            /// Returns the printed form: `E0201`.
            pub fn text(self) -> &'static str {
                match self { $(DiagnosticCode::$variant => $text,)* }
            }

            /// One line that names the kind of mistake.
            pub fn title(self) -> &'static str {
                match self { $(DiagnosticCode::$variant => $title,)* }
            }
        }
    };
}

codes! {
    // Characters and tokens: E01..
    UnknownCharacter = "E0101", "a character that Buzz does not use";
    UnterminatedString = "E0102", "a string without its closing quote";
    UnknownEscape = "E0103", "an escape that Buzz does not know";
    MalformedNumber = "E0104", "a number that cannot be read";
    NumberOutOfRange = "E0105", "a number that no profile can hold";
    ForeignOperator = "E0106", "an operator of another language";
    ForeignComment = "E0107", "a comment of another language";
    TypographicQuote = "E0108", "a typographic quote around a string";
    // Syntax: E02..
    UnexpectedToken = "E0201", "something else was expected here";
    UnclosedBracket = "E0202", "a bracket that is never closed";
    UnmatchedClosing = "E0203", "a closing bracket without an opening one";
    ChainedComparison = "E0204", "comparisons in a row";
    TableInExpression = "E0205", "a table literal as an operand";
    TrailingComma = "E0206", "a comma with nothing after it";
    AssignToCall = "E0207", "an assignment to the result of a call";
    BareBlock = "E0208", "a block that belongs to no statement";
    NestedFunction = "E0209", "a named function inside a block";
    FunctionWithoutName = "E0210", "a function statement without a name";
    VarInFor = "E0211", "var in the head of a for loop";
    SemicolonInFor = "E0212", "semicolons in the head of a for loop";
    ConditionWithoutParentheses = "E0213", "a condition that is not in parentheses";
    ValueAsStatement = "E0214", "a value that stands alone";
    ComparisonAsStatement = "E0215", "a comparison where an assignment is meant";
    NestingTooDeep = "E0216", "too many levels of nesting";
    ForeignWord = "E0217", "a word that is no keyword of Buzz";
    NumberAsField = "E0218", "a number after a dot";
    AssignmentInCondition = "E0219", "an assignment where a condition is expected";
    FieldWithoutDot = "E0220", "a table field that is not written `.name = value`";
    CallOfValue = "E0221", "a value that cannot be called or indexed directly";
    ElseWithoutIf = "E0222", "an else without an if";
    // Includes: E03..
    IncludeNotFound = "E0301", "an included file that does not exist";
    IncludeMisplaced = "E0302", "an include inside a statement";
    FileUnreadable = "E0303", "a file that cannot be read";
    FileNotUtf8 = "E0304", "a file that is not UTF-8 text";
    FileTooLarge = "E0305", "a file that is too large for a script";
    IncludeWithoutString = "E0306", "an include without a file name in quotes";
    // Names, functions and arguments: E04..
    UnknownFunction = "E0401", "a call of a function that nothing defines";
    MissingRobotFunction = "E0402", "a function that this robot lacks";
    BuiltinArguments = "E0403", "a wrong number of arguments for a built-in function";
    RobotArguments = "E0404", "a wrong number of arguments for a robot function";
    RobotArgumentType = "E0405", "an argument of the wrong type for a robot function";
    DuplicateVariable = "E0406", "a local variable declared twice";
    DuplicateParameter = "E0407", "two parameters of one name";
    SelfAssigned = "E0408", "self declared or assigned";
    NoFiles = "E0409", "files on a robot";
    UnknownMemberCalled = "E0410", "a call of a library function that does not exist";
    NotCallable = "E0411", "a call of something that is no function";
    ProfileLacks = "E0412", "a function that the number profile lacks";
    // Literals and types: E05..
    IntegerRange = "E0501", "an integer that does not fit the number profile";
    FloatRange = "E0502", "a float that does not fit the number profile";
    Incomparable = "E0503", "an order between values that have none";
    // Limits of the image and of the robot: E06..
    TooManyParameters = "E0601", "too many parameters";
    FunctionTooDeep = "E0602", "a function that needs too many values at a time";
    TooManyArguments = "E0603", "too many arguments or captured variables";
    FunctionTooLong = "E0604", "a statement that is too long";
    ImageTooLarge = "E0605", "a script that does not fit an image";
    TooManyGlobals = "E0606", "more globals than the robot has room for";
    FlashBudget = "E0607", "an image that is larger than the robot's flash";
    MissingFeature = "E0608", "a part of the virtual machine that the robot lacks";
    CallsTooDeep = "E0609", "calls that need more memory than the robot has";
    Internal = "E0699", "a mistake in the compiler";
    // Warnings: W01.. syntax, W02.. names, W03.. values
    RunOnStatement = "W0101", "a statement that runs on over the line";
    ConditionValue = "W0102", "and/or as a value is only 0 or 1";
    MixedAndOr = "W0103", "and and or have the same precedence";
    WideNot = "W0104", "not covers everything to its right";
    OperatorGrouping = "W0105", "operators that group otherwise than in C or Python";
    ReturnFromNextLine = "W0106", "return takes its value from the next line";
    IncludeFromWorkingFolder = "W0107", "an include found only in the working folder";
    BitwiseNotOfCondition = "W0108", "`!` where a condition is meant";
    SemicolonBeforeBody = "W0109", "a `;` between a condition and its body";
    EmptyBody = "W0110", "an if, else or loop without a body";
    SecondPoint = "W0111", "a number with a second decimal point";
    UnknownAllowance = "W0112", "a comment for bbz that it does not know";
    UnusablePageComment = "W0113", "a comment for the page that it cannot use";
    NeverAssigned = "W0201", "a name that nothing defines: it is nil";
    RobotNameTaken = "W0202", "a robot function's name used for something else";
    BuiltinNameTaken = "W0203", "a built-in name used for something else";
    FunctionRedefined = "W0204", "a function that another definition or a value replaces";
    MissingArguments = "W0205", "a call with fewer arguments than parameters";
    ExtraArguments = "W0206", "a call with more arguments than parameters";
    CaptureAssigned = "W0207", "an assignment that changes only a copy";
    UnknownMember = "W0208", "a field that does not exist: it is nil";
    SelfIsNil = "W0209", "self where it is always nil";
    OwnInitializer = "W0210", "a variable used in its own first value";
    Unreachable = "W0211", "code that can never run";
    EntryMisspelt = "W0212", "a function named almost like an entry point";
    EntryParameters = "W0213", "an entry point with parameters";
    EntryNotFunction = "W0214", "an entry point that is no function";
    UnusedVariable = "W0215", "a local variable that nothing reads";
    UnusedParameter = "W0216", "a parameter that nothing reads";
    UnusedFunction = "W0217", "a function that nothing calls";
    SelfAssignment = "W0218", "an assignment of a variable to itself";
    OnlyOwnValue = "W0219", "a global computed from itself only: it is nil";
    CallbackParameters = "W0220", "a callback with more parameters than it gets";
    CallbackMeaning = "W0221", "a callback parameter that gets something else";
    UnknownNeighborField = "W0222", "a field that a neighbor's data lacks: it is nil";
    CallForgotten = "W0223", "a function where its result is meant";
    CreateInStep = "W0224", "a stigmergy created again in every step";
    ManyStigmergies = "W0225", "a stigmergy whose entries take several frames";
    OneSidedConflict = "W0226", "a conflict handler that always returns the same side";
    LongInStep = "W0227", "a message of several frames in every step";
    UnknownFunctionUnused = "W0228", "a call of an unknown function where nothing runs";
    TopicNeverSent = "W0229", "a listener for a topic that the script never sends";
    ImpossibleOperation = "W0301", "an operation that always fails";
    DivisionByZero = "W0302", "a division by zero";
    ShiftCount = "W0303", "a shift by an impossible count";
    BadKey = "W0304", "a value that cannot be a table key";
    NeverEqual = "W0305", "a comparison of different types: always unequal";
    BuiltinArgumentType = "W0306", "an argument of the wrong type for a built-in function";
    LogFormat = "W0307", "a format in log, which knows none";
    DuplicateKey = "W0308", "a key that a table literal gives twice";
    IntegerWraps = "W0309", "an operation on constants that wraps";
    FloatOverflows = "W0310", "an operation on constants that becomes infinite";
    SumStops = "W0311", "a sum of small numbers that stops growing";
    NeighborByNumber = "W0312", "a number from 0 on in place of a neighbor's id";
    EndlessLoop = "W0313", "a loop whose condition nothing changes";
    DegreesForRadians = "W0314", "an angle in degrees where radians are needed";
    ArgumentRange = "W0315", "a number outside the range of a robot function's parameter";
}

impl DiagnosticCode {
    /// Returns the severity, which decides if the diagnostic stops the build.
    pub fn severity(self) -> Severity {
        if self.text().starts_with('W') { Severity::Warning } else { Severity::Error }
    }
}
