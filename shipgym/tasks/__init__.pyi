from .definition import TaskDefinition as TaskDefinition
from .definition import read_definition as read_definition
from .scales import control_interval as control_interval
from .task import Task as Task
from .task import course_keeping_task as course_keeping_task
from .task import path_following_task as path_following_task
